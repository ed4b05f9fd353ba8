// Places that movers pass. Goes beyond the paper.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/cause.hpp"
#include "dynains/evidence/instance_samples.hpp"
#include "dynains/evidence/sample_places.hpp"
#include "dynains/stage/evidence_verdict.hpp"
#include "dynains/stage/free_space_config.hpp"
#include "dynains/voxel/voxel_key.hpp"

namespace dynains {

/// Counts in cells of the world how much of what was met there moved. Where that is nearly all,
/// what seems to stay moves, too: in a crowd, others hide that a place was left, and whoever hits
/// it again is one of them.
///
/// What is kept is bounded: cells that no scan met for long make room for others.
class DynamicOccupancyGrid {
 public:
  using Verdict = EvidenceVerdict::Group;
  /// What a supervoxel was counted as.
  enum class Count : std::uint8_t { kNone, kStayed, kMoved };

  explicit DynamicOccupancyGrid(const FreeSpaceConfig& config)
      : cell_(config.dynamic_grid_cell),
        share_(static_cast<float>(config.dynamic_grid_ratio)),
        memory_(config.lookback_scans),
        lines_(config.dynamic_grid_ratio < 1.0 ? kLines : 0),
        passed_(lines_.size()) {}

  /// Forgets all cells; to be called before the frame `origin` changes.
  void forget() {
    std::fill(lines_.begin(), lines_.end(), Line());
    std::fill(passed_.begin(), passed_.end(), false);
  }

  /// Takes in what is said of scan number `scan`, by supervoxel, in the place of what was `counted`
  /// of it before, and says of what stays in a passage that it moves. `origin`: a frame near the
  /// scans, the same for all of them.
  void judge(std::uint64_t scan, const InstanceSamples& samples,
             const Eigen::Isometry3d& T_origin_sensor, std::vector<Count>& counted,
             std::vector<Verdict>& verdicts) {
    if (lines_.empty()) return;
    detail::find_places(samples, cell_, T_origin_sensor, places_);
    const std::uint32_t now = static_cast<std::uint32_t>(scan) + 1;
    for (std::size_t s = 0; s < samples.supervoxel_count(); ++s) {
      const Count count = count_of(verdicts[s].cause);
      if (count == counted[s]) continue;
      for (std::uint32_t i = samples.sample_begin[s]; i < samples.sample_begin[s + 1]; ++i) {
        if (i + kAhead < places_.size()) __builtin_prefetch(&lines_[line_of(places_[i + kAhead])]);
        recount(places_[i], now, counted[s], count);
      }
      counted[s] = count;
    }
    for (std::size_t s = 0; s < samples.supervoxel_count(); ++s) {
      if (counted[s] == Count::kStayed) judge_supervoxel(samples, s, now, verdicts[s]);
    }
  }

 private:
  struct Cell {
    VoxelKey place = 0;
    std::uint32_t met = 0;  // number of the latest scan that met it, from 1
    std::uint16_t stayed = 0;
    std::uint16_t moved = 0;
  };
  // Cells that share a line of the processor's cache.
  struct alignas(64) Line {
    std::array<Cell, 4> cells;
  };

  static constexpr std::size_t kLines = 1U << 15;
  static constexpr std::uint16_t kMostCounted = 1000;  // beyond, what is older counts half
  static constexpr std::uint16_t kLeastMoved = 3;      // samples
  static constexpr std::uint32_t kPart = 4;            // one of so many samples in a passage
  static constexpr std::size_t kAhead = 32;            // samples whose cells are asked for

  // What is presumed was not seen to move.
  static Count count_of(Cause cause) {
    if (cause == Cause::kPresumed) return Count::kNone;
    return is_dynamic(cause) ? Count::kMoved : Count::kStayed;
  }

  static std::size_t line_of(VoxelKey place) { return voxel_hash(place) >> 8 & (kLines - 1); }

  // The cell of a place if it was met lately.
  const Cell* find(VoxelKey place, std::uint32_t now) const {
    for (const Cell& cell : lines_[line_of(place)].cells) {
      if (cell.place == place) return age(cell, now) <= memory_ ? &cell : nullptr;
    }
    return nullptr;
  }

  // The cell of a place, which may be a new one instead of that which was met longest ago.
  Cell& meet(VoxelKey place, std::uint32_t now) {
    Line& line = lines_[line_of(place)];
    for (Cell& cell : line.cells) {
      if (cell.place != place) continue;
      if (age(cell, now) > memory_) cell = {place, now, 0, 0};
      cell.met = std::max(cell.met, now);
      return cell;
    }
    Cell& oldest = *std::min_element(line.cells.begin(), line.cells.end(),
                                     [](const Cell& a, const Cell& b) { return a.met < b.met; });
    oldest = {place, now, 0, 0};
    const bool passed = std::any_of(line.cells.begin(), line.cells.end(),
                                    [](const Cell& cell) { return cell.moved >= kLeastMoved; });
    passed_[line_of(place)] = passed;
    return oldest;
  }

  // Scans since a cell was met; negative if a later scan met it.
  static std::int32_t age(const Cell& cell, std::uint32_t now) {
    return static_cast<std::int32_t>(now - cell.met);
  }

  // Counts a sample as something else than before.
  void recount(VoxelKey place, std::uint32_t now, Count before, Count count) {
    Cell& cell = meet(place, now);
    if (before == Count::kMoved && cell.moved > 0) --cell.moved;
    if (before == Count::kStayed && cell.stayed > 0) --cell.stayed;
    if (count == Count::kMoved) ++cell.moved;
    if (count == Count::kStayed) ++cell.stayed;
    if (cell.moved >= kLeastMoved) passed_[line_of(place)] = true;
    if (cell.moved + cell.stayed < kMostCounted) return;
    cell.moved /= 2;
    cell.stayed /= 2;
  }

  static float moved_share(const Cell& cell) {
    return static_cast<float>(cell.moved) / static_cast<float>(cell.moved + cell.stayed);
  }

  void judge_supervoxel(const InstanceSamples& samples, std::size_t s, std::uint32_t now,
                        Verdict& verdict) const {
    const std::uint32_t begin = samples.sample_begin[s];
    const std::uint32_t end = samples.sample_begin[s + 1];
    std::uint32_t inside = 0;
    float highest = 0.0F;
    for (std::uint32_t i = begin; i < end; ++i) {
      if (!passed_[line_of(places_[i])]) continue;
      const Cell* const cell = find(places_[i], now);
      if (cell == nullptr || cell->moved < kLeastMoved) continue;
      const float share = moved_share(*cell);
      if (!(share > share_)) continue;
      ++inside;
      highest = std::max(highest, share);
    }
    if (inside == 0 || kPart * inside < end - begin) return;
    verdict = {Cause::kDynamicOccupancy, std::max(verdict.belief, highest)};
  }

  double cell_;
  float share_;
  std::int32_t memory_;
  std::vector<Line> lines_;
  // By line: whether any of its cells may be a passage. Few are, and most samples need no look at
  // their cell.
  std::vector<bool> passed_;
  std::vector<VoxelKey> places_;  // by sample
};

}  // namespace dynains
