// Samples of the ground of one scan, with their visibility from reference scans.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "dynains/evidence/free_space_config.hpp"
#include "dynains/evidence/instance_samples.hpp"
#include "dynains/evidence/visibility.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

/// Maximum height above the ground of the lowest return of an object on it: the greater
/// of `least` and `slope` * horizontal range. The gap between two beams defines `slope`.
struct Clearance {
  float least;  ///< m
  float slope;  ///< m per m
};

/// Horizontal grid around the sensor with the height of the lowest removed point in the 3x3 cells
/// of each cell. All points are in the sensor frame (m).
class GroundFootprint {
 public:
  /// Block number `block` of `points`; the last block may be shorter.
  static PointsView block_of(PointsView points, std::size_t block) {
    const std::size_t begin = block * kWordBits;
    return points.subview(begin, std::min(kWordBits, points.size() - begin));
  }
  static std::size_t block_count(std::size_t points) {
    return (points + kWordBits - 1) / kWordBits;
  }

  /// `cell` (m): edge of the cells. A removed point affects its cell and the eight cells around it.
  /// `max_range` (m): points beyond are ignored.
  GroundFootprint(double cell, double max_range)
      : per_metre_(static_cast<float>(1.0 / cell)),
        width_(2 * (static_cast<std::int32_t>(std::ceil(max_range / cell)) + 2)),
        lowest_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(width_), kNothing) {
    touched_.reserve(lowest_.size());  // uses address space only
  }

  /// Adds the points of a block whose bits are set in `which`.
  void add(PointsView block, std::uint64_t which) {
    const Located located = locate(block);
    std::int32_t cell = 0;  // of the last points, neighbours on an object
    float lowest = kNothing;
    for_each_bit(which & located.inside, [&](std::size_t i) {
      if (located.cell[i] != cell && lowest != kNothing) add_around(cell, lowest);
      lowest = located.cell[i] != cell ? block.z[i] : std::min(lowest, block.z[i]);
      cell = located.cell[i];
    });
    if (lowest != kNothing) add_around(cell, lowest);
  }

  /// The bits of the points of a block that lie less than `clearance` below the lowest removed
  /// point of the 3x3 cells around them.
  std::uint64_t find_under(PointsView block, const Clearance& clearance) const {
    const Located located = locate(block);
    float lowest[kWordBits];
    for (std::size_t i = 0; i < block.size(); ++i) {
      lowest[i] = lowest_[static_cast<std::size_t>(located.cell[i])];
    }
    const PackConstant least(clearance.least), slope(clearance.slope);
    std::uint64_t under = 0;
    for_packs(block.size(), [&](const auto& at) {
      using Float = typename std::decay_t<decltype(at)>::Float;
      const Float x = at.load(block.x.data());
      const Float y = at.load(block.y.data());
      const Float gap = sqrt(x * x + y * y) * slope;
      const Float top = at.load(block.z.data()) + max(gap, Float(least));
      under |= std::uint64_t{(at.load(lowest) < top).bits()} << at.begin;
    });
    return under & located.inside;
  }

  bool empty() const { return touched_.empty(); }

  /// Removes all points.
  void clear() {
    for (const std::size_t cell : touched_) lowest_[cell] = kNothing;
    touched_.clear();
  }

 private:
  static constexpr float kNothing = std::numeric_limits<float>::infinity();

  // Adds the lowest point (m) of a cell.
  void add_around(std::int32_t centre, float lowest) {
    for (std::int32_t first = centre - width_; first <= centre + width_; first += width_) {
      for (std::int32_t at = first - 1; at <= first + 1; ++at) {
        const auto cell = static_cast<std::size_t>(at);
        if (lowest_[cell] == kNothing) touched_.push_back(cell);
        lowest_[cell] = std::min(lowest_[cell], lowest);
      }
    }
  }

  // By point of a block: its cell; bits of the points inside the grid, whose border has none.
  struct Located {
    std::array<std::int32_t, kWordBits> cell;
    std::uint64_t inside;
  };
  Located locate(PointsView block) const {
    Located located;
    located.inside = 0;
    const std::int32_t half = width_ / 2;
    const PackConstant per_metre(per_metre_), centre(static_cast<float>(half)),
        border(static_cast<float>(width_ - 1));
    for_packs(block.size(), [&](auto at) {
      using Float = typename decltype(at)::Float;
      using Int = typename decltype(at)::Int;
      const Int zero(0), last(width_ - 1);
      const auto line = [&](const Float& coordinate) {
        return truncate(min(max(coordinate * per_metre + centre, Float(0.0F)), Float(border)));
      };
      const Int column = line(at.load(block.x.data()));
      const Int row = line(at.load(block.y.data()));
      (multiply(row, width_) + column).store(&located.cell[at.begin]);
      const auto inside = (zero < column) & (column < last) & (zero < row) & (row < last);
      located.inside |= std::uint64_t{inside.bits() & ((1U << at.size()) - 1U)} << at.begin;
    });
    return located;
  }

  float per_metre_;
  std::int32_t width_;                // of the grid, in cells
  std::vector<float> lowest_;         // m, row-major: lowest removed point in the 3x3 cells
  std::vector<std::size_t> touched_;  // cells with a lowest point
};

/// The ground of one scan. Consecutive ground points in one voxel are a run, and the first point of
/// a run represents it. Each voxel has one sample among the first points of its runs.
struct GroundSamples {
  std::vector<std::uint64_t> run_begins;  ///< by block of 64 ground points: bits of first points
  PointBuffer points;                     ///< samples, m, sensor frame; padded for packs
  std::size_t count = 0;                  ///< number of samples
  std::vector<std::uint32_t> group_of;    ///< by run: its sample, plus 1; 0 or more than all: none
  std::vector<std::uint8_t> free;         ///< by sample: number of references with "free"
  std::vector<std::uint8_t> hit;          ///< by sample: number of references with "hit"

  std::size_t size() const { return count; }

  /// Adds the visibility of the samples from one reference. At most 255 references.
  void add(const Visibility& visibility) { visibility.add_to(size(), free.data(), hit.data()); }
};

/// Selects the samples of the ground.
class GroundSampler {
 public:
  explicit GroundSampler(const FreeSpaceConfig& config)
      : sampler_(config.ground_sample, config.evidence_range, 1) {}

  /// Replaces `out` by the samples of one scan, without visibility. `ground`: m, sensor frame.
  void sample(PointsView ground, GroundSamples& out) {
    const std::size_t blocks = GroundFootprint::block_count(ground.size());
    ensure_capacity(out.run_begins, blocks);
    out.run_begins.assign(blocks, 0);
    std::size_t runs = 0;
    for (std::size_t i = 0; i < blocks; ++i) {
      const PointsView block = GroundFootprint::block_of(ground, i);
      out.run_begins[i] = sampler_.find_changes(block);
      firsts_.grow(runs + kWordBits);
      for_each_bit(out.run_begins[i], [&](std::size_t k) { firsts_.set(runs++, block, k); });
    }
    grow(instance_of_, runs);
    sampler_.sample(PointsView(firsts_).subview(0, runs),
                    Span<const std::uint32_t>(instance_of_).subspan(0, runs), 1, samples_);
    std::swap(out.points, samples_.points);
    out.group_of.swap(samples_.group_of_point);
    out.count = samples_.size();
    const std::size_t counts = (out.size() + 7) / 8 * 8;
    ensure_capacity(out.free, counts);
    ensure_capacity(out.hit, counts);
    out.free.assign(counts, 0);
    out.hit.assign(counts, 0);
  }

 private:
  InstanceSampler sampler_;
  PointBuffer firsts_;                      // by run: its first point
  std::vector<std::uint32_t> instance_of_;  // by run: instance 0
  InstanceSamples samples_;                 // of this instance
};

}  // namespace dynains::detail
