// Ground points that are removed with dynamic instances: the feet of objects, and object points
// with the label ground.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "dynains/evidence/free_space_config.hpp"
#include "dynains/evidence/ground_samples.hpp"
#include "dynains/points.hpp"
#include "dynains/sensor/plane_fit.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/verdict.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::detail {

/// Ground planes by horizontal cells of 2 m in the sensor frame. Each plane is fitted to the ground
/// points of its cell and of the eight cells around it.
class SurroundingGround {
 public:
  /// Height above ground with too few points for a plane.
  static constexpr float kUnknown = std::numeric_limits<float>::infinity();

  /// Replaces the ground points (m).
  void assign(PointsView points) {
    numbers_.clear();
    cells_.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      cell_at(points.x[i], points.y[i])
          .moments.add(static_cast<double>(points.x[i]), static_cast<double>(points.y[i]),
                       static_cast<double>(points.z[i]), 1.0);
    }
  }

  /// Height (m) of a point (m) above the plane of its cell, along z, or kUnknown.
  float height(float x, float y, float z) {
    Cell& cell = cell_at(x, y);
    if (!cell.is_fitted) {
      cell.is_fitted = true;
      cell.plane = plane_around(cell.place);
    }
    if (!cell.plane) return kUnknown;
    const Plane& plane = *cell.plane;
    const double distance = plane.normal_x * (static_cast<double>(x) - plane.mean_x) +
                            plane.normal_y * (static_cast<double>(y) - plane.mean_y) +
                            plane.normal_z * (static_cast<double>(z) - plane.mean_z);
    return static_cast<float>(distance / plane.normal_z);
  }

 private:
  static constexpr float kCell = 2.0F;  // m

  struct Cell {
    VoxelKey place;
    PlaneMoments moments;        // of its points
    std::optional<Plane> plane;  // through the points of this cell and of the cells around it
    bool is_fitted = false;
  };

  Cell& cell_at(float x, float y) {
    const VoxelKey place =
        voxel_key(floor_to<std::int32_t>(x / kCell), floor_to<std::int32_t>(y / kCell), 0);
    if (last_ < cells_.size() && cells_[last_].place == place) return cells_[last_];
    last_ = numbers_.insert(place);
    if (last_ == cells_.size()) cells_.push_back({place, {}, {}, false});
    return cells_[last_];
  }

  // Few points, or points on a line, do not define a plane.
  std::optional<Plane> plane_around(VoxelKey place) const {
    constexpr double kMinPoints = 8.0;
    constexpr double kMinVariance = 0.4;  // m^2, along any horizontal direction
    PlaneMoments sum;
    for (int i = 0; i < 9; ++i) {
      const std::uint32_t beside = numbers_.find(place + voxel_key_step(i % 3 - 1, i / 3 - 1, 0));
      if (beside != kNoIndex) sum += cells_[beside].moments;
    }
    if (sum.count < kMinPoints) return std::nullopt;
    const double xx = variance_along(sum, {1.0, 0.0, 0.0});
    const double yy = variance_along(sum, {0.0, 1.0, 0.0});
    const double xy = variance_along(sum, {M_SQRT1_2, M_SQRT1_2, 0.0}) - 0.5 * (xx + yy);
    const double half = 0.5 * (xx - yy);
    const double least = 0.5 * (xx + yy) - std::sqrt(half * half + xy * xy);
    return least >= kMinVariance ? std::optional(fit_plane(sum)) : std::nullopt;
  }

  VoxelHashTable<> numbers_;  // of the cells
  std::vector<Cell> cells_;
  std::size_t last_ = 0;  // cell of the last point
};

/// Finds the moved ground points of one scan: those under removed points, and those in voxels that
/// are free in reference scans. Call add() for the removed points, then find(). All points are in
/// the sensor frame (m).
class MovedGround {
 public:
  using Verdict = EvidenceVerdict::Group;

  explicit MovedGround(const FreeSpaceConfig& config)
      : removes_footprint_(config.footprint > 0.0),
        rise_(static_cast<float>(config.footprint_rise)),
        belief_(static_cast<float>(config.tau_free)),
        footprint_(std::max(config.footprint, kMinCell),
                   removes_footprint_ ? config.evidence_range : 0.0) {}

  void adapt(const SensorModel& sensor) {
    // The lowest return of an object may lie one gap between two beams above its foot.
    clearance_.slope = static_cast<float>(std::tan(sensor.elevation_gap_wide * M_PI / 180.0));
  }

  /// Adds the points of dynamic groups. `group_of`: by point, index in `groups`.
  void add(PointsView points, Span<const std::uint32_t> group_of, Span<const Verdict> groups) {
    grow(moved_, groups.size());
    bool any = false;
    for (std::size_t i = 0; i < groups.size(); ++i) {
      const bool moved = is_dynamic(groups[i].cause);
      moved_[i] = moved ? 1 : 0;
      any |= moved;
    }
    if (!any) return;
    const std::uint8_t* const moved = moved_.data();
    const std::uint32_t* const group = group_of.data();
    for (std::size_t i = 0; i < GroundFootprint::block_count(points.size()); ++i) {
      const PointsView block = GroundFootprint::block_of(points, i);
      std::uint64_t which = 0;
      for (std::size_t k = 0; k < block.size(); ++k) {
        which |= std::uint64_t{moved[group[i * kWordBits + k]]} << k;
      }
      if (which != 0) footprint_.add(block, which);
    }
  }

  /// Returns the ground points to remove, and clears the added points. `samples`: of `ground`. The
  /// span is valid until the next call.
  Span<const EvidenceVerdict::GroundPoint> find(PointsView ground, const GroundSamples& samples) {
    found_.clear();
    under_.assign(GroundFootprint::block_count(ground.size()), 0);
    bool any = false;
    if (!footprint_.empty() && removes_footprint_) {
      with_packs([&](auto) {
        for (std::size_t i = 0; i < under_.size(); ++i) {
          under_[i] = footprint_.find_under(GroundFootprint::block_of(ground, i), clearance_);
          any |= under_[i] != 0;
        }
      });
    }
    if (any && rise_ > 0.0F) find_surroundings(ground, samples);
    any |= judge_samples(samples);
    if (any) remove_points(ground, samples);
    footprint_.clear();
    return found_;
  }

 private:
  static constexpr double kMinCell = 0.1;       // m, smallest cell of the footprint
  static constexpr std::uint32_t kMinFree = 2;  // "free" references of a moved voxel
  static constexpr std::uint32_t kMinHit = 3;   // "hit" references of a voxel that is ground
  static constexpr float kMaxGap = 0.1F;        // m between two beams whose hits show the ground

  /// Result of the references for a sample of the ground.
  enum class Seen : std::uint8_t { kUnknown, kMoved, kGround };

  // The first points of the runs beside the removed points give the height of the surrounding
  // ground, which is unknown without samples.
  void find_surroundings(PointsView ground, const GroundSamples& samples) {
    std::size_t count = 0;
    for (std::size_t i = 0; samples.size() > 0 && i < under_.size(); ++i) {
      const PointsView block = GroundFootprint::block_of(ground, i);
      const std::uint64_t beside = ~under_[i] & all_of(block);
      around_points_.grow(count + kWordBits);
      const std::uint64_t first = beside & (samples.run_begins[i] | ~(beside << 1U));
      for_each_bit(first, [&](std::size_t k) { around_points_.set(count++, block, k); });
    }
    around_.assign(PointsView(around_points_).subview(0, count));
  }

  // Sets `seen_` by GroundSamples::group_of; returns whether any voxel has moved. Where beams are
  // far apart, few references have a beam near a sample: one is sufficient if no other one hit it.
  bool judge_samples(const GroundSamples& samples) {
    bool any = false;
    seen_.assign(samples.size() + 2, Seen::kUnknown);
    for (std::size_t sample = 0; sample < samples.size(); ++sample) {
      const std::uint8_t free = samples.free[sample], hit = samples.hit[sample];
      if (free >= kMinFree ||
          (free > 0 && hit == 0 && !is_dense(samples.points.x[sample], samples.points.y[sample]))) {
        seen_[sample + 1] = Seen::kMoved;
        any = true;
      } else if (free == 0 && hit >= kMinHit) {
        seen_[sample + 1] = Seen::kGround;
      }
    }
    return any;
  }

  // Removes the runs in moved voxels, and the points under removed points that rise above the
  // surrounding ground (the foot of an object), or whose surrounding ground is unknown.
  void remove_points(PointsView ground, const GroundSamples& samples) {
    const auto lowest = [](std::uint64_t bits) { return bits & (~bits + 1); };
    const std::uint32_t* group = samples.group_of.data();
    for (std::size_t i = 0; i < under_.size(); ++i) {
      const PointsView block = GroundFootprint::block_of(ground, i);
      const std::uint64_t runs = samples.size() > 0 ? samples.run_begins[i] : 0;
      std::uint64_t rising = rise_ > 0.0F ? find_rising(block, under_[i]) : under_[i];
      std::uint64_t moved = 0;
      for (std::uint64_t left = runs; left != 0; left &= left - 1, ++group) {
        const Seen seen = seen_[*group];
        if (seen == Seen::kUnknown) continue;
        const std::uint64_t first = lowest(left);
        const std::uint64_t next = lowest(left ^ first);  // 0 behind the last run
        const std::uint64_t run = (next - 1) & ~(first - 1) & all_of(block);
        if (seen == Seen::kMoved) {
          moved |= run;
        } else if ((rising & run) != 0) {
          rising &= ~find_seen(block, rising & run, samples.points.z[*group - 1]);
        }
      }
      remove(i, rising, Cause::kUnderInstance);
      remove(i, moved & ~under_[i], Cause::kFreeSpace);
    }
  }

  // The bits of `which` whose points rise above the surrounding ground.
  std::uint64_t find_rising(PointsView block, std::uint64_t which) {
    std::uint64_t bits = 0;
    for_each_bit(which, [&](std::size_t k) {
      const bool rises = around_.height(block.x[k], block.y[k], block.z[k]) >= rise_;
      bits |= std::uint64_t{rises} << k;
    });
    return bits;
  }

  // The bits of `which` whose points do not rise above a sample at height `z` that references hit.
  // The plane through a kerb lies below the pavement. Where beams are far apart, the hits may lie
  // above or below the sample.
  std::uint64_t find_seen(PointsView block, std::uint64_t which, float z) const {
    std::uint64_t bits = 0;
    for_each_bit(which, [&](std::size_t k) {
      const bool is_seen = is_dense(block.x[k], block.y[k]) && block.z[k] < z + rise_;
      bits |= std::uint64_t{is_seen} << k;
    });
    return bits;
  }

  // Whether the gap between two beams is small at a horizontal place.
  bool is_dense(float x, float y) const {
    return std::sqrt(x * x + y * y) * clearance_.slope < kMaxGap;
  }

  static std::uint64_t all_of(PointsView block) {
    return ~std::uint64_t{0} >> (kWordBits - block.size());
  }

  // Adds the points of a block whose bits are set in `which` to the result.
  void remove(std::size_t block, std::uint64_t which, Cause cause) {
    const std::size_t begin = block * kWordBits;
    for_each_bit(which, [&](std::size_t i) {
      found_.push_back({static_cast<std::uint32_t>(begin + i), {cause, belief_}});
    });
  }

  bool removes_footprint_;
  float rise_;
  float belief_;
  GroundFootprint footprint_;
  SurroundingGround around_;
  PointBuffer around_points_;
  std::vector<std::uint64_t> under_;    // by block of the ground: points under removed points
  Clearance clearance_ = {0.4F, 0.0F};  // between the ground and objects on it
  std::vector<EvidenceVerdict::GroundPoint> found_;
  std::vector<std::uint8_t> moved_;  // by group of points
  std::vector<Seen> seen_;           // by group of runs
};

}  // namespace dynains::detail
