// Sums of the signs of plausibility over a running window of scans.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "dynains/verdict.hpp"

namespace dynains::detail {

/// Finds intervals of scans that no LiDAR has.
class ScanRate {
 public:
  /// `interval`: s since the previous scan. `max_gap`: RemoverConfig::max_gap, s.
  TimeDoubt add(double interval, double max_gap) {
    constexpr std::size_t kEnough = 3;  // intervals; a pause is one
    slow_ = interval > max_gap ? slow_ + 1 : 0;
    fast_ = interval < 1e-3 ? fast_ + 1 : 0;  // s
    if (slow_ >= kEnough) return TimeDoubt::kTooSlow;
    return fast_ >= kEnough ? TimeDoubt::kTooFast : TimeDoubt::kNone;
  }

 private:
  std::size_t slow_ = 0, fast_ = 0;  // of the last intervals, without a break
};

/// Bounds of PlausibilityCheck. docs/reliability.md has the distribution behind them.
struct PlausibilityBounds {
  std::size_t window = 10;                          ///< scans
  float unjudged = 0.98F;                           ///< ratio
  float misfits = 0.35F;                            ///< ratio
  float residual = 0.05F;                           ///< m
  double jump = 0.15;                               ///< m, residual of one jump that counts
  float ground_free = 0.35F, instance_free = 0.5F;  ///< ratios, each alone
  float both_ground_free = 0.12F, both_instance_free = 0.2F;  ///< together
  std::uint64_t min_beams = 300;                              ///< for a share of the ground
  std::uint64_t min_samples = 500;                            ///< for a share of instances
};

/// Finds windows of scans that no correct recording gives.
class PlausibilityCheck {
 public:
  static constexpr PlausibilityBounds kBounds{};

  struct Scan {
    std::uint64_t scan = 0;          ///< number of the push
    std::size_t points = 0;          ///< pushed
    std::size_t judged = 0;          ///< of them
    SurfaceCounts surfaces;          ///< zero without comparisons
    std::optional<double> residual;  ///< m
    bool is_misfit = false;          ///< begins an epoch against the poses
  };

  /// Adds a scan; the result is that of the window which ends with it.
  Plausibility add(const Scan& scan) {
    scans_[count_++ % kBounds.window] = scan;
    Plausibility result = summary();
    result.suspicion = judge(result);
    if (result.suspicion != last_.suspicion) {
      const std::uint64_t back = std::min<std::uint64_t>(scan.scan, kBounds.window - 1);
      result.since = result.suspicion == Suspicion::kNone ? 0 : scan.scan - back;
    } else {
      result.since = last_.since;
    }
    last_ = result;
    return result;
  }

 private:
  static float ratio(std::uint64_t part, std::uint64_t whole, std::uint64_t fewest) {
    return whole < fewest ? 0.0F : static_cast<float>(part) / static_cast<float>(whole);
  }

  Plausibility summary() const {
    const std::size_t count = std::min(count_, kBounds.window);
    SurfaceCounts sum;
    const SurfaceCounts* most = &scans_[0].surfaces;
    std::uint64_t points = 0, judged = 0, misfits = 0, residuals = 0;
    double residual = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      const Scan& scan = scans_[i];
      sum += scan.surfaces;
      if (scan.surfaces.ground_free > most->ground_free) most = &scan.surfaces;
      points += scan.points;
      judged += scan.judged;
      misfits += scan.is_misfit ? 1 : 0;
      residuals += scan.residual ? 1 : 0;
      residual += std::min(scan.residual.value_or(0.0), kBounds.jump);
    }
    // A fault of the recording is in all scans, the sway of a shock in one.
    sum.ground_free -= most->ground_free;
    sum.ground_hit -= most->ground_hit;
    Plausibility result;
    result.not_judged = ratio(points - judged, points, 1);
    result.ground_free =
        ratio(sum.ground_free, sum.ground_free + sum.ground_hit, kBounds.min_beams);
    result.instance_free = ratio(sum.instances_free, sum.instances_decided, kBounds.min_samples);
    result.misfits = ratio(misfits, count, kBounds.window);
    if (2 * residuals >= kBounds.window) {
      result.residual = static_cast<float>(residual / static_cast<double>(residuals));
    }
    return result;
  }

  Suspicion judge(const Plausibility& window) const {
    if (count_ < kBounds.window) return Suspicion::kNone;
    if (window.not_judged > kBounds.unjudged) return Suspicion::kUnits;
    if (window.misfits > kBounds.misfits || window.residual > kBounds.residual)
      return Suspicion::kPoses;
    const bool is_free = window.ground_free > kBounds.ground_free ||
                         window.instance_free > kBounds.instance_free ||
                         (window.ground_free > kBounds.both_ground_free &&
                          window.instance_free > kBounds.both_instance_free);
    return is_free ? Suspicion::kRays : Suspicion::kNone;
  }

  std::array<Scan, kBounds.window> scans_;
  std::size_t count_ = 0;
  Plausibility last_;
};

}  // namespace dynains::detail
