// Counts and scores of both protocols.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "dynains/evaluation/truth.hpp"
#include "dynains/verdict.hpp"

namespace dynains::evaluation {

/// 100 * part / whole; NaN if `whole` is 0.
inline double percent(std::uint64_t part, std::uint64_t whole) {
  if (whole == 0) return std::numeric_limits<double>::quiet_NaN();
  return 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

/// Harmonic mean; 0 if both are 0, NaN if one is NaN.
inline double harmonic_mean(double a, double b) { return a + b == 0 ? 0 : 2 * a * b / (a + b); }

/// Numbers of static and of dynamic voxels, points or objects, and of right verdicts on them.
struct Score {
  std::uint64_t static_total = 0;
  std::uint64_t static_kept = 0;
  std::uint64_t dynamic_total = 0;
  std::uint64_t dynamic_removed = 0;

  /// Adds `total` voxels, points or objects with this truth, of which `kept` are in the map.
  void add(Truth truth, std::uint64_t total, std::uint64_t kept) {
    if (truth == Truth::kDynamic) {
      dynamic_total += total;
      dynamic_removed += total - kept;
    } else {
      static_total += total;
      static_kept += kept;
    }
  }

  double kept() const { return percent(static_kept, static_total); }          ///< PR or SA, %
  double removed() const { return percent(dynamic_removed, dynamic_total); }  ///< RR or DA, %
  /// F1, in [0, 1]; NaN without static or without dynamic ones.
  double f1() const { return harmonic() / 100; }
  double associated() const { return std::sqrt(kept() * removed()); }   ///< AA, %
  double harmonic() const { return harmonic_mean(kept(), removed()); }  ///< HA, %
};

/// An object is all points of the recording with one label: class, but for ground, and instance id,
/// which is not 0.
struct ObjectLimits {
  static constexpr std::uint64_t kMinPoints = 50;  ///< of an object that is judged
  static constexpr double kKept = 0.90;            ///< least share of points of one that is kept
  static constexpr double kRemoved = 0.95;         ///< of one that is removed
};

/// Objects and points of one class. Objects with few points count by points only.
struct ClassScore {
  std::uint16_t id = 0;  ///< SemanticKITTI class
  Truth truth = Truth::kStatic;
  std::uint64_t objects = 0;  ///< with enough points
  std::uint64_t right = 0;    ///< objects that are kept or removed as of ObjectLimits
  std::uint64_t points = 0;
  std::uint64_t points_kept = 0;

  /// Number of points that are not in the map.
  std::uint64_t removed() const { return points - points_kept; }
};

using dynains::Cause;
using dynains::kCauseCount;

/// Names of causes in the error analysis.
inline constexpr std::array<const char*, kCauseCount> kCauseNames = {"unknown",
                                                                     "called ground",
                                                                     "similarity too high",
                                                                     "belief reverted",
                                                                     "too few points",
                                                                     "too few scans",
                                                                     "not judged",
                                                                     "proposed by occupancy",
                                                                     "seen free",
                                                                     "with dynamic instance",
                                                                     "under an instance",
                                                                     "no evidence",
                                                                     "along its track",
                                                                     "presumed",
                                                                     "seen occupied",
                                                                     "seen free too little",
                                                                     "dynamic occupancy",
                                                                     "came or went",
                                                                     "stands"};

/// Numbers of wrong and right verdicts with one cause.
struct CauseErrors {
  std::uint64_t missed_dynamic = 0;
  std::uint64_t lost_static = 0;
  std::uint64_t right = 0;
};

}  // namespace dynains::evaluation
