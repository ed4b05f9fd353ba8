// Samples of the ground of one scan, with their visibility from reference scans.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/evidence/free_space_config.hpp"
#include "dynains/evidence/ground_footprint.hpp"
#include "dynains/evidence/instance_samples.hpp"
#include "dynains/evidence/visibility.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/bits.hpp"

namespace dynains::detail {

/// The ground of one scan. Consecutive ground points in one voxel are a run, and the first point of
/// a run represents it. Each voxel has one sample among the first points of its runs.
struct GroundSamples {
  std::vector<std::uint64_t> run_begins;  ///< by block of 64 ground points: bits of first points
  InstanceSamples samples;                ///< of one instance, by run in the place of points
  std::vector<std::uint8_t> free;         ///< by sample: number of references with "free"
  std::vector<std::uint8_t> hit;          ///< by sample: number of references with "hit"

  std::size_t size() const { return samples.size(); }

  /// Adds the visibility of the samples from one reference. At most 255 references.
  void add(const Visibility& visibility) { visibility.add_to(size(), free.data(), hit.data()); }
};

/// Selects the samples of the ground.
class GroundSampler {
 public:
  explicit GroundSampler(const FreeSpaceConfig& config)
      : is_active_(config.test_ground), sampler_(config.ground_sample, config.evidence_range, 1) {}

  /// Replaces `out` by the samples of one scan, without visibility; no samples if the ground is not
  /// tested. `ground`: m, sensor frame.
  void sample(PointsView ground, GroundSamples& out) {
    constexpr std::size_t kBlock = GroundFootprint::kBlock;
    const std::size_t blocks = GroundFootprint::block_count(ground.size());
    ensure_capacity(out.run_begins, blocks);
    out.run_begins.assign(blocks, 0);
    if (!is_active_) return;
    std::size_t runs = 0;
    for (std::size_t i = 0; i < blocks; ++i) {
      const PointsView block = GroundFootprint::block_of(ground, i * kBlock);
      out.run_begins[i] = sampler_.find_changes(block);
      firsts_.grow(runs + kBlock);
      for_each_bit(out.run_begins[i], [&](std::size_t k) {
        firsts_.x[runs] = block.x[k];
        firsts_.y[runs] = block.y[k];
        firsts_.z[runs] = block.z[k];
        ++runs;
      });
    }
    grow(instance_of_, runs);
    sampler_.sample(PointsView(firsts_).subview(0, runs),
                    Span<const std::uint32_t>(instance_of_).subspan(0, runs), 1, out.samples);
    const std::size_t counts = (out.size() + 7) / 8 * 8;
    ensure_capacity(out.free, counts);
    ensure_capacity(out.hit, counts);
    out.free.assign(counts, 0);
    out.hit.assign(counts, 0);
  }

 private:
  bool is_active_;
  InstanceSampler sampler_;
  PointBuffer firsts_;                      // by run: its first point
  std::vector<std::uint32_t> instance_of_;  // by run: instance 0
};

}  // namespace dynains::detail
