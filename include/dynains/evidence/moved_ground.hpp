// Ground points that are removed with dynamic instances: the feet of objects, and object points
// with the label ground.
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

/// Horizontal hull of points on a grid. A cell belongs to the hull if it lies between the first and
/// the last occupied cell of its row, and of its column.
class InstanceHull {
 public:
  /// `cell`: edge of the cells, m.
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
      in_row_[static_cast<std::size_t>(row)].extend(column);
      in_column_[static_cast<std::size_t>(column)].extend(row);
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
    void extend(std::int32_t cell) {
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

/// Finds the moved ground points of one scan. Call add() and add_hull() for the removed points,
/// then find(). All points are in the sensor frame (m).
class MovedGround {
 public:
  using Verdict = EvidenceVerdict::Group;

  explicit MovedGround(const FreeSpaceConfig& config)
      : removes_footprint_(config.footprint > 0.0),
        tests_ground_(config.test_ground),
        rise_(static_cast<float>(config.footprint_rise)),
        belief_(static_cast<float>(config.tau_free)),
        footprint_(removes_footprint_ ? std::max(config.footprint, kLeastCell) : kDefaultCell,
                   config.evidence_range),
        around_(config.evidence_range),
        hull_(2.0 * std::max(config.footprint, kLeastCell)),
        sampler_(config.ground_sample, config.evidence_range, 1) {}

  void adapt(const SensorModel& sensor) {
    // The lowest return of an object may lie one gap between two beams above its foot.
    clearance_.slope = static_cast<float>(std::tan(sensor.elevation_gap_wide * M_PI / 180.0));
  }

  /// Computes the box of each block of 64 ground points. The boxes are valid for all verdicts on a
  /// scan.
  void bound(PointsView ground, std::vector<GroundBox>& boxes) const {
    footprint_.bound(ground, boxes);
  }

  /// Adds the area below a compact instance. `points`: its samples, at least one.
  void add_hull(PointsView points) {
    if (!removes_footprint_) return;
    const float lowest = *std::min_element(points.z.begin(), points.z.end());
    hull_.visit(points, [&](float x, float y) { footprint_.add(x, y, lowest); });
  }

  /// Adds the points of dynamic groups. `group_of`: by point, index in `groups`.
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

  /// Returns the ground points to remove, and clears the added points. `boxes`: result of bound()
  /// for `ground`. `for_each_reference(points, count, visit)`: calls `visit(visibility)` for each
  /// reference of the scan, with the visibility of the first `count` points. The span is valid
  /// until the next call.
  template <class References>
  Span<const EvidenceVerdict::GroundPoint> find(PointsView ground, Span<const GroundBox> boxes,
                                                References&& for_each_reference) {
    found_.clear();
    if (footprint_.empty() && !tests_ground_) return found_;
    footprint_.spread();
    tested_points_.grow(ground.size());
    detail::ensure_capacity(tested_blocks_, boxes.size());
    tested_blocks_.clear();
    tested_ = 0;
    detail::ensure_capacity(under_, boxes.size());
    under_.clear();
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const std::size_t begin = i * GroundFootprint::kBlock;
      const PointsView block = GroundFootprint::block_of(ground, begin);
      const std::uint64_t under =
          removes_footprint_ ? footprint_.find_under(block, boxes[i], clearance_) : 0;
      if (under != 0) under_.push_back({begin, under});
      const std::uint64_t all = ~std::uint64_t{0} >> (GroundFootprint::kBlock - block.size());
      if (tests_ground_) add_tested(ground, begin, all & ~under);
    }
    remove_under(ground);
    if (tested_ > 0) test(for_each_reference);
    footprint_.clear();
    return found_;
  }

 private:
  // Some points of a block of the ground.
  struct Block {
    std::size_t begin;     // index of the first point of the block
    std::uint64_t points;  // bits of the points
  };
  // The tested points of a block of the ground.
  struct TestedBlock {
    std::size_t begin;     // index of the first point of the block
    std::uint64_t points;  // bits of the tested points
    std::uint64_t first;   // bits of the tested points that begin a run
    std::size_t run;       // number of the first run
  };
  static constexpr double kLeastCell = 0.05;      // m, smallest cell of the footprint
  static constexpr double kDefaultCell = 0.2;     // m, cell for a footprint of 0
  static constexpr std::uint32_t kLeastFree = 2;  // "free" references of a moved voxel
  static constexpr float kLeastRatio = 0.3F;      // "free" to "hit" references of a moved voxel

  // Removes ground points under removed points, in cells with a point that rises above the
  // surrounding ground (the foot of an object) or whose surrounding ground is unknown.
  void remove_under(PointsView ground) {
    if (rise_ > 0.0F && !under_.empty()) remove_flat_cells(ground);
    for (const Block& block : under_) {
      remove(block.begin, block.points, Cause::kUnderInstance);
    }
  }

  // Deletes the points of flat cells from `under_`: these stay in the ground.
  void remove_flat_cells(PointsView ground) {
    around_.assign(PointsView(tested_points_).subview(0, tested_), rise_);
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

  // Adds the points of a block whose bits are set in `which` to the result.
  void remove(std::size_t begin, std::uint64_t which, Cause cause) {
    detail::for_each_bit(which, [&](std::size_t i) {
      found_.push_back({static_cast<std::uint32_t>(begin + i), {cause, belief_}});
    });
  }

  // Adds points of a block to the test. Consecutive points in one voxel are a run, and the first
  // point of a run represents it.
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

  // Removes the tested points that are free in enough references.
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

  // Sets `moved_` by index in InstanceSamples::met; returns whether any voxel has moved.
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

  bool removes_footprint_;
  bool tests_ground_;
  float rise_;
  float belief_;
  GroundFootprint footprint_;
  SurroundingGround around_;
  std::vector<Block> under_;  // ground points under removed points
  InstanceHull hull_;
  InstanceSampler sampler_;
  Clearance clearance_ = {0.4F, 0.0F};  // between the ground and objects on it
  std::vector<EvidenceVerdict::GroundPoint> found_;
  std::vector<std::uint8_t> moved_;  // by group, then by index in InstanceSamples::met
  std::vector<TestedBlock> tested_blocks_;
  std::size_t tested_ = 0;                   // number of runs of tested points
  PointBuffer tested_points_;                // by run: its first point
  std::vector<std::uint32_t> one_instance_;  // by run: instance 0
  InstanceSamples samples_;                  // of the runs
  std::vector<std::uint8_t> free_;           // by sample: number of references with "free"
  std::vector<std::uint8_t> hit_;            // by sample: number of references with "hit"
};

}  // namespace dynains
