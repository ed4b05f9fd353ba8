// Dynamic occupancy grid: world cells in which most samples are dynamic. Goes beyond the paper.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/evidence/free_space_config.hpp"
#include "dynains/evidence/instance_samples.hpp"
#include "dynains/evidence/instance_tracks.hpp"
#include "dynains/pose.hpp"
#include "dynains/verdict.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::detail {

/// Counts dynamic and static samples per cell of the world. In cells where nearly all samples are
/// dynamic, the remaining samples become dynamic, too. Reason: in a crowd, pedestrians occlude each
/// other, so few reference scans have free samples, and later hits in a cell often come from
/// another pedestrian. Compare Dynablox (Schmid et al., RA-L 8(10), 2023).
///
/// The number of cells is bounded: a new cell replaces the cell with the oldest sample.
class DynamicOccupancyGrid {
 public:
  using Verdict = EvidenceVerdict::Group;
  /// Count in which the samples of a supervoxel are included.
  enum class Count : std::uint8_t { kNone, kStatic, kDynamic };

  explicit DynamicOccupancyGrid(const FreeSpaceConfig& config)
      : cell_(config.dynamic_grid_cell),
        ratio_(static_cast<float>(config.dynamic_grid_ratio)),
        lookback_scans_(config.lookback_scans),
        lines_(config.dynamic_grid_ratio < 1.0 ? kLines : 0),
        may_be_dynamic_(lines_.size()) {}

  /// Removes all cells. Call it before the origin frame changes.
  void clear() {
    std::fill(lines_.begin(), lines_.end(), Line());
    std::fill(may_be_dynamic_.begin(), may_be_dynamic_.end(), std::uint8_t{0});
  }

  /// Counts the samples of scan number `scan` by their verdicts, and changes verdicts of static
  /// supervoxels in dynamic cells to kDynamicOccupancy. `counted`: by supervoxel, counts of the
  /// preceding call for the scan, which this call replaces; kNone before the first call.
  /// `verdicts`: by supervoxel. `tracked`: of final verdicts, else null; instances that are too
  /// large for tracks need a lower ratio, since they may include a dynamic object beside a static
  /// one. The origin frame is fixed until clear() and near all scans.
  void judge(std::uint64_t scan, const InstanceSamples& samples, const Pose& T_origin_sensor,
             std::vector<Count>& counted, std::vector<Verdict>& verdicts,
             const TrackedInstances* tracked = nullptr) {
    if (lines_.empty()) return;
    find_cells(samples, cell_, T_origin_sensor, keys_);
    line_of_.resize(keys_.size());
    std::transform(keys_.begin(), keys_.end(), line_of_.begin(), line_of);
    const std::uint32_t now = static_cast<std::uint32_t>(scan) + 1;
    for (std::size_t s = 0; s < samples.supervoxel_count(); ++s) {
      const Count count = count_of(verdicts[s].cause);
      if (count == counted[s]) continue;
      for (std::uint32_t i = samples.sample_begin[s]; i < samples.sample_begin[s + 1]; ++i) {
        if (i + kPrefetchDistance < keys_.size())
          __builtin_prefetch(&lines_[line_of_[i + kPrefetchDistance]]);
        recount(i, now, counted[s], count);
      }
      counted[s] = count;
    }
    for (std::size_t s = 0; s < samples.supervoxel_count(); ++s) {
      if (counted[s] != Count::kStatic) continue;
      const float highest =
          highest_ratio(samples.sample_begin[s], samples.sample_begin[s + 1], now);
      if (highest <= 0.0F) continue;
      const bool is_large = tracked != nullptr && !tracked->shapes[samples.instance_of[s]].carried;
      if (highest <= (is_large ? kOfLarge * ratio_ : ratio_)) continue;
      verdicts[s] = {Cause::kDynamicOccupancy, std::max(verdicts[s].belief, highest)};
    }
  }

 private:
  struct Cell {
    VoxelKey key = 0;
    std::uint32_t last_scan = 0;  // number of the latest scan with samples in the cell, plus 1
    std::uint16_t static_count = 0;
    std::uint16_t dynamic_count = 0;
  };
  // Cells that share one cache line.
  struct alignas(64) Line {
    std::array<Cell, 4> cells;
  };

  static constexpr std::size_t kLines = 1U << 15;
  static constexpr std::uint16_t kMaxCount = 1000;      // total at which both counts are halved
  static constexpr std::size_t kPrefetchDistance = 32;  // samples
  static constexpr float kOfLarge = 0.7F;               // factor of the ratio of large instances

  // Presumed instances count as static: they have no evidence of motion.
  static Count count_of(Cause cause) {
    return is_dynamic(cause) && cause != Cause::kPresumed ? Count::kDynamic : Count::kStatic;
  }

  static std::uint32_t line_of(VoxelKey key) { return voxel_hash(key) >> 8 & (kLines - 1); }

  // The cell of a sample; null if it has no samples of the last lookback scans.
  const Cell* find(std::size_t sample, std::uint32_t now) const {
    for (const Cell& cell : lines_[line_of_[sample]].cells) {
      if (cell.key == keys_[sample]) return age(cell, now) <= lookback_scans_ ? &cell : nullptr;
    }
    return nullptr;
  }

  // The cell of a sample; a new cell replaces the oldest cell of its line.
  Cell& cell_for(std::size_t sample, std::uint32_t now) {
    const VoxelKey key = keys_[sample];
    Line& line = lines_[line_of_[sample]];
    for (Cell& cell : line.cells) {
      if (cell.key != key) continue;
      if (age(cell, now) > lookback_scans_) cell = {key, now, 0, 0};
      cell.last_scan = std::max(cell.last_scan, now);
      return cell;
    }
    Cell& oldest =
        *std::min_element(line.cells.begin(), line.cells.end(),
                          [](const Cell& a, const Cell& b) { return a.last_scan < b.last_scan; });
    oldest = {key, now, 0, 0};
    may_be_dynamic_[line_of_[sample]] =
        std::any_of(line.cells.begin(), line.cells.end(),
                    [](const Cell& cell) { return cell.dynamic_count > 0; });
    return oldest;
  }

  // Scans since the last sample of the cell; negative if a later scan has samples in it.
  static std::int32_t age(const Cell& cell, std::uint32_t now) {
    return static_cast<std::int32_t>(now - cell.last_scan);
  }

  // Counts one sample as `count` instead of `before`.
  void recount(std::size_t sample, std::uint32_t now, Count before, Count count) {
    Cell& cell = cell_for(sample, now);
    if (before == Count::kDynamic && cell.dynamic_count > 0) --cell.dynamic_count;
    if (before == Count::kStatic && cell.static_count > 0) --cell.static_count;
    if (count == Count::kDynamic) ++cell.dynamic_count;
    if (count == Count::kStatic) ++cell.static_count;
    if (cell.dynamic_count > 0) may_be_dynamic_[line_of_[sample]] = 1;
    if (cell.dynamic_count + cell.static_count < kMaxCount) return;
    cell.dynamic_count /= 2;
    cell.static_count /= 2;
  }

  static float dynamic_ratio(const Cell& cell) {
    return static_cast<float>(cell.dynamic_count) /
           static_cast<float>(std::max(cell.dynamic_count + cell.static_count, 1));
  }

  // Highest ratio of dynamic samples of the cells of samples [begin, end).
  float highest_ratio(std::uint32_t begin, std::uint32_t end, std::uint32_t now) const {
    float highest = 0.0F;
    for (std::uint32_t i = begin; i < end; ++i) {
      if (may_be_dynamic_[line_of_[i]] == 0) continue;
      const Cell* const cell = find(i, now);
      if (cell != nullptr) highest = std::max(highest, dynamic_ratio(*cell));
    }
    return highest;
  }

  double cell_;
  float ratio_;
  std::int32_t lookback_scans_;
  std::vector<Line> lines_;
  // By line: whether any of its cells may be dynamic. Few lines have such cells, so most samples
  // need no access to their cell.
  std::vector<std::uint8_t> may_be_dynamic_;
  std::vector<VoxelKey> keys_;          // by sample
  std::vector<std::uint32_t> line_of_;  // by sample
};

}  // namespace dynains::detail
