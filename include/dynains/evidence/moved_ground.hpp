// Ground points that are removed with instances: feet of objects within the footprint, and points
// that were labelled as ground by mistake.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "dynains/evidence/ground_footprint.hpp"
#include "dynains/evidence/instance_samples.hpp"
#include "dynains/evidence/surrounding_ground.hpp"
#include "dynains/evidence/visibility.hpp"
#include "dynains/points.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/simd/bits.hpp"
#include "dynains/stage/free_space_config.hpp"
#include "dynains/verdict.hpp"

namespace dynains {

/// Horizontal hull of points by cells: a cell belongs to it if it lies between two points (or at
/// one) in its row, and in its column.
class InstanceHull {
 public:
  /// `cell`: m.
  explicit InstanceHull(double cell) : cell_(static_cast<float>(cell)) {}

  /// Calls `visit(x, y)` with the centre (m) of each cell of the hull of `points` (m). Ignores
  /// instances of more than 100 cells along an axis, which are not single objects.
  template <class Visitor>
  void visit(PointsView points, Visitor&& visit) {
    if (points.empty()) return;
    const auto x_range = std::minmax_element(points.x.begin(), points.x.end());
    const auto y_range = std::minmax_element(points.y.begin(), points.y.end());
    const std::int32_t first_column = cell_of(*x_range.first);
    const std::int32_t first_row = cell_of(*y_range.first);
    const std::int32_t columns = cell_of(*x_range.second) - first_column + 1;
    const std::int32_t rows = cell_of(*y_range.second) - first_row + 1;
    if (columns > kMostCells || rows > kMostCells) return;
    in_row_.assign(static_cast<std::size_t>(rows), Extent());
    in_column_.assign(static_cast<std::size_t>(columns), Extent());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::int32_t column = cell_of(points.x[i]) - first_column;
      const std::int32_t row = cell_of(points.y[i]) - first_row;
      in_row_[static_cast<std::size_t>(row)].take(column);
      in_column_[static_cast<std::size_t>(column)].take(row);
    }
    for (std::int32_t row = 0; row < rows; ++row) {
      const Extent& extent = in_row_[static_cast<std::size_t>(row)];
      for (std::int32_t column = extent.first; column <= extent.last; ++column) {
        const Extent& across = in_column_[static_cast<std::size_t>(column)];
        if (row < across.first || row > across.last) continue;
        visit((static_cast<float>(first_column + column) + 0.5F) * cell_,
              (static_cast<float>(first_row + row) + 0.5F) * cell_);
      }
    }
  }

 private:
  static constexpr std::int32_t kMostCells = 100;

  struct Extent {
    std::int32_t first = std::numeric_limits<std::int32_t>::max();
    std::int32_t last = std::numeric_limits<std::int32_t>::min();
    void take(std::int32_t cell) {
      first = std::min(first, cell);
      last = std::max(last, cell);
    }
  };

  std::int32_t cell_of(float coordinate) const {
    return static_cast<std::int32_t>(std::floor(coordinate / cell_));
  }

  float cell_;
  std::vector<Extent> in_row_;
  std::vector<Extent> in_column_;
};

/// Finds the moved ground of one scan: add the removed points, then call find().
class MovedGround {
 public:
  using Verdict = EvidenceVerdict::Group;

  explicit MovedGround(const FreeSpaceConfig& config)
      : takes_footprint_(config.footprint > 0.0),
        tests_(config.ground_test_distance > 0.0),
        rise_(static_cast<float>(config.footprint_rise)),
        belief_(static_cast<float>(config.tau_free)),
        footprint_(takes_footprint_ ? std::max(config.footprint, kLeastCell) : kDefaultCell,
                   std::max({config.ground_test_distance, config.footprint, 0.5}),
                   config.evidence_range),
        around_(config.evidence_range),
        hull_(2.0 * std::max(config.footprint, kLeastCell)),
        sampler_(config.ground_sample, config.evidence_range, 1) {}

  void adapt(const SensorModel& sensor) {
    // The lowest return of an object may lie one gap between beams above its foot.
    clearance_.slope = static_cast<float>(std::tan(sensor.elevation_gap_wide * M_PI / 180.0));
  }

  /// Boxes of every 64 ground points; valid for all verdicts on a scan.
  void bound(PointsView ground, std::vector<GroundBox>& boxes) const {
    footprint_.bound(ground, boxes);
  }

  /// Adds the area below a compact instance. `points` (m): its samples.
  void add_hull(PointsView points) {
    if (!takes_footprint_) return;
    const float lowest = *std::min_element(points.z.begin(), points.z.end());
    hull_.visit(points, [&](float x, float y) { footprint_.add(x, y, lowest); });
  }

  /// Adds the points of dynamic groups.
  void add(PointsView points, Span<const std::uint32_t> group_of, Span<const Verdict> groups) {
    detail::grow(moved_, groups.size());
    bool any = false;
    for (std::size_t i = 0; i < groups.size(); ++i) {
      const bool moved = is_dynamic(groups[i].cause);
      moved_[i] = moved ? 1 : 0;
      any |= moved;
    }
    if (!any) return;
    const std::uint8_t* const moved = moved_.data();
    const std::uint32_t* const group = group_of.data();
    for (std::size_t begin = 0; begin < points.size(); begin += GroundFootprint::kBlock) {
      const PointsView block = GroundFootprint::block_of(points, begin);
      std::uint64_t which = 0;
      for (std::size_t i = 0; i < block.size(); ++i) {
        which |= std::uint64_t{moved[group[begin + i]]} << i;
      }
      if (which != 0) footprint_.add(block, which);
    }
  }

  /// The ground points to remove; clears the added points. `boxes`: of bound().
  /// `for_each_reference(points, count, visit)`: calls `visit(visibility)` for each reference of
  /// the scan, with the visibility of the first `count` points. The span holds until the next call.
  template <class References>
  Span<const EvidenceVerdict::GroundPoint> find(PointsView ground, Span<const GroundBox> boxes,
                                                References&& for_each_reference) {
    found_.clear();
    if (footprint_.empty()) return found_;
    footprint_.spread();
    tested_points_.grow(ground.size());
    detail::ensure_capacity(tested_blocks_, boxes.size());
    tested_blocks_.clear();
    tested_ = 0;
    detail::ensure_capacity(under_, boxes.size());
    under_.clear();
    footprint_.visit_near(ground, boxes, clearance_,
                          [&](std::size_t begin, std::uint64_t near, std::uint64_t below) {
                            const std::uint64_t under = takes_footprint_ ? below : 0;
                            if (under != 0) under_.push_back({begin, under});
                            if (tests_) add_tested(ground, begin, near & ~under);
                          });
    remove_under(ground);
    if (tested_ > 0) test(for_each_reference);
    footprint_.clear();
    return found_;
  }

 private:
  // Points of a block of the ground, one bit each.
  struct Block {
    std::size_t begin;     // point
    std::uint64_t points;  // which
  };
  // Tested points of a block of the ground, one bit each.
  struct TestedBlock {
    std::size_t begin;     // point
    std::uint64_t points;  // which
    std::uint64_t first;   // those that begin a run
    std::size_t run;       // number of the first run
  };
  static constexpr double kLeastCell = 0.05;   // m, of the footprint
  static constexpr double kDefaultCell = 0.2;  // m, if the footprint is off
  static constexpr std::uint32_t kLeastFree = 2;
  static constexpr float kLeastRatio = 0.3F;

  // Removes the ground under removed points in cells with a point that rises above the ground
  // around (the foot of an object), and where the height of the ground around is unknown.
  void remove_under(PointsView ground) {
    if (rise_ > 0.0F && !under_.empty()) remove_flat_cells(ground);
    for (const Block& block : under_) {
      remove(block.begin, block.points, Cause::kUnderInstance);
    }
  }

  void remove_flat_cells(PointsView ground) {
    around_.take(PointsView(tested_points_).subview(0, tested_), rise_);
    for (const Block& block : under_) {
      const PointsView points = GroundFootprint::block_of(ground, block.begin);
      std::uint64_t rising = 0;
      detail::for_each_bit(block.points, [&](std::size_t i) {
        const bool rises = around_.height(points.x[i], points.y[i], points.z[i]) >= rise_;
        rising |= std::uint64_t{rises} << i;
      });
      if (rising != 0) footprint_.mark(points, rising);
    }
    for (Block& block : under_) {
      block.points =
          footprint_.find_marked(GroundFootprint::block_of(ground, block.begin), block.points);
    }
  }

  // Lists the points of a block from `begin` on whose bits are set.
  void remove(std::size_t begin, std::uint64_t which, Cause cause) {
    detail::for_each_bit(which, [&](std::size_t i) {
      found_.push_back({static_cast<std::uint32_t>(begin + i), {cause, belief_}});
    });
  }

  // Adds points to be tested: runs of points in one voxel, represented by their first point.
  void add_tested(PointsView ground, std::size_t begin, std::uint64_t which) {
    if (which == 0) return;
    const std::uint64_t changes = sampler_.find_changes(GroundFootprint::block_of(ground, begin));
    const std::uint64_t first = which & (changes | ~(which << 1U));
    tested_blocks_.push_back({begin, which, first, tested_});
    detail::for_each_bit(first, [&](std::size_t i) {
      tested_points_.x[tested_] = ground.x[begin + i];
      tested_points_.y[tested_] = ground.y[begin + i];
      tested_points_.z[tested_] = ground.z[begin + i];
      ++tested_;
    });
  }

  // Removes the tested points that enough references find free.
  template <class References>
  void test(References&& for_each_reference) {
    detail::grow(one_instance_, tested_);
    sampler_.sample(PointsView(tested_points_).subview(0, tested_),
                    Span<const std::uint32_t>(one_instance_).subspan(0, tested_), 1, samples_);
    const std::size_t count = samples_.size();
    free_.assign((count + 7) / 8 * 8, 0);
    hit_.assign((count + 7) / 8 * 8, 0);
    for_each_reference(samples_.points, count, [&](const detail::Visibility& visibility) {
      visibility.add_to(count, free_.data(), hit_.data());
    });
    if (find_free_voxels()) remove_free_runs();
  }

  // Sets `moved_` by position in InstanceSamples::met; returns whether there is any.
  bool find_free_voxels() {
    bool any = false;
    detail::grow(moved_, samples_.met.size());
    moved_[0] = 0;
    for (std::size_t met = 1; met < samples_.met.size(); ++met) {
      const std::uint32_t sample = samples_.sample_begin[samples_.met[met]];
      const std::uint8_t free = free_[sample];
      const bool moved = free >= kLeastFree &&
                         static_cast<float>(free) >= kLeastRatio * static_cast<float>(hit_[sample]);
      moved_[met] = moved ? 1 : 0;
      any |= moved;
    }
    return any;
  }

  void remove_free_runs() {
    const auto lowest = [](std::uint64_t bits) { return bits & (~bits + 1); };
    for (const TestedBlock& block : tested_blocks_) {
      const std::uint32_t* met = &samples_.met_of[block.run];
      for (std::uint64_t left = block.first; left != 0; left &= left - 1) {
        if (moved_[*met++] == 0) continue;
        const std::uint64_t first = lowest(left);
        const std::uint64_t next = lowest(left ^ first);  // 0 behind the last run
        remove(block.begin, block.points & (next - 1) & ~(first - 1), Cause::kFreeSpace);
      }
    }
  }

  bool takes_footprint_;
  bool tests_;
  float rise_;
  float belief_;
  GroundFootprint footprint_;
  SurroundingGround around_;
  std::vector<Block> under_;  // points under removed points
  InstanceHull hull_;
  InstanceSampler sampler_;
  Clearance clearance_ = {0.4F, 0.0F};  // between the ground and objects on it
  std::vector<EvidenceVerdict::GroundPoint> found_;
  std::vector<std::uint8_t> moved_;  // by group, later by position in InstanceSamples::met
  // Tested ground points, in runs that share a voxel.
  std::vector<TestedBlock> tested_blocks_;
  std::size_t tested_ = 0;                   // runs
  PointBuffer tested_points_;                // their first points
  std::vector<std::uint32_t> one_instance_;  // zeros
  InstanceSamples samples_;
  std::vector<std::uint8_t> free_;  // by sample: number of references
  std::vector<std::uint8_t> hit_;
};

}  // namespace dynains
