// Free-space beliefs of the supervoxels and the instances of one scan.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/evidence/instance_samples.hpp"
#include "dynains/evidence/visibility.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/bits.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/stage/free_space_config.hpp"
#include "dynains/stage/log_odds.hpp"

namespace dynains {

/// Beliefs on the samples of one scan.
struct InstanceBeliefs {
  /// Log-odds that a place was free, a sum that is never below zero (Page's test for a change,
  /// 1954). A place that is hit for long and then free has changed: early hits do not cancel later
  /// free space. Thin objects, which some beams miss, are hit too often for the sum to grow.
  struct Belief {
    float level = 0.0F;          ///< sum over the references of one side of time, >= 0
    float peak = 0.0F;           ///< maximum of `level`
    std::uint8_t contested = 0;  ///< some reference hit the place
    std::uint8_t occupied = 0;   ///< some reference hit enough of its samples
    std::uint8_t hit_again = 0;  ///< some reference hit it while `level` > 0
  };
  /// Numbers of samples of an instance.
  struct Counts {
    std::uint32_t total = 0;
    std::uint32_t moved = 0;    ///< in free supervoxels
    std::uint32_t decided = 0;  ///< in free or occupied supervoxels
  };

  std::vector<Belief> supervoxels;
  std::vector<Belief> wholes;         ///< by instance, for all its samples together
  std::vector<Counts> counts;         ///< by instance
  std::vector<std::uint64_t> open;    ///< bit by sample: a hit may change its belief
  std::vector<std::uint8_t> changed;  ///< by instance: some belief changed; reset by the caller
};

/// Updates beliefs by the visibility from references, and derives decisions from them.
class InstanceBeliefUpdater {
 public:
  using Belief = InstanceBeliefs::Belief;
  using Counts = InstanceBeliefs::Counts;

  static constexpr float kLeastKnown =
      0.3F;  ///< ratio of decided to all samples of a still instance

  explicit InstanceBeliefUpdater(const FreeSpaceConfig& config)
      : pass_ratio_(static_cast<float>(config.pass_ratio)),
        removal_ratio_(static_cast<float>(config.removal_ratio)),
        sum_(config.p_free, config.p_hit),
        free_level_(static_cast<float>(log_odds(config.tau_free))),
        contested_level_(static_cast<float>(log_odds(config.tau_contested))),
        whole_level_(static_cast<float>(log_odds(config.tau_whole))) {}

  /// Log-odds increment of one observation of free space.
  float increment() const { return sum_.increment(); }
  /// Log-odds from which a place without hits was free.
  float free_level() const { return free_level_; }

  /// Resets the beliefs for the samples of a new scan.
  void begin(const InstanceSamples& samples, InstanceBeliefs& out) const {
    const std::size_t instances = samples.instance_count();
    out.supervoxels.assign(samples.supervoxel_count(), Belief());
    out.wholes.assign(instances, Belief());
    out.changed.assign(instances, 1);
    out.counts.resize(instances);
    for (std::size_t instance = 0; instance < instances; ++instance) {
      out.counts[instance] = {samples.count(instance), 0, 0};
    }
    out.open.assign(samples.size() / 64 + 1, ~std::uint64_t{0});
  }

  /// Starts the sums of the references on the other side of time.
  void begin_other_side(const InstanceSamples& samples, InstanceBeliefs& beliefs) const {
    for (std::uint32_t s = 0; s < beliefs.supervoxels.size(); ++s) {
      Belief& belief = beliefs.supervoxels[s];
      if (belief.occupied != 0 && belief.level > 0.0F) flip_open(samples, s, beliefs);
      belief.level = 0.0F;
    }
    for (Belief& belief : beliefs.wholes) belief.level = 0.0F;
  }

  /// Adds the visibility of the samples from one reference. Calls `on_hit(instance)` for each
  /// instance with enough visible samples, nearly all of which are hit.
  template <class OnHit>
  void update(const InstanceSamples& samples, const detail::Visibility& visibility,
              InstanceBeliefs& beliefs, OnHit&& on_hit) {
    // Processors with AVX2 have instructions that find and count bits.
    detail::run_packs([&](auto) {
      update_supervoxels(samples, visibility, beliefs);
      update_wholes(samples, visibility, beliefs, on_hit);
    });
  }

  bool is_free(const Belief& belief) const {
    return belief.peak >= (belief.contested != 0 ? contested_level_ : free_level_);
  }

  /// Whether beams passed an instance as a whole, or enough of its decided samples were free. If
  /// fewer than half of these were free, and some were hit afterwards, enough of its lower half
  /// must be free, too, if that is known: beams pass the windows of a parked car, but not its body.
  bool removes_whole(const InstanceSamples& samples, const InstanceBeliefs& beliefs,
                     std::size_t instance) const {
    const Counts& share = beliefs.counts[instance];
    const Belief& whole = beliefs.wholes[instance];
    const bool seen_through = whole.peak >= (whole.contested != 0 ? whole_level_ : free_level_);
    if (!seen_through && !is_enough(share)) return false;
    if (2 * share.moved >= share.decided) return true;
    const bool hit_again =
        seen_through ? whole.hit_again != 0 : was_hit_again(samples, beliefs, instance);
    if (!hit_again) return true;
    const Counts lower_half = counts_of_lower_half(samples, beliefs, instance);
    return lower_half.decided < kLeastBody || is_enough(lower_half);
  }

 private:
  static constexpr float kLeastView = 0.25F;          // ratio of visible samples of an instance
  static constexpr float kLeastFree = 0.15F;          // ratio of free samples of a supervoxel
  static constexpr std::uint32_t kLeastBody = 12;     // decided samples of the lower half
  static constexpr float kContradictingHits = 0.85F;  // ratio to visible samples of an instance
  // A supervoxel is occupied if two of its samples are hit, and one of so many.
  static constexpr std::uint32_t kLeastHit = 4;

  bool is_enough(const Counts& share) const {
    return share.moved > 0 &&
           static_cast<float>(share.moved) >= removal_ratio_ * static_cast<float>(share.decided);
  }

  // Whether any free supervoxel of an instance was hit afterwards.
  bool was_hit_again(const InstanceSamples& samples, const InstanceBeliefs& beliefs,
                     std::size_t instance) const {
    const auto* const all = beliefs.supervoxels.data();
    return std::any_of(
        all + samples.supervoxel_begin[instance], all + samples.supervoxel_begin[instance + 1],
        [&](const Belief& belief) { return belief.hit_again != 0 && is_free(belief); });
  }

  // Counts of the supervoxels in the lower half of the layers of an instance.
  Counts counts_of_lower_half(const InstanceSamples& samples, const InstanceBeliefs& beliefs,
                              std::size_t instance) const {
    const std::uint32_t begin = samples.supervoxel_begin[instance];
    const std::uint32_t end = samples.supervoxel_begin[instance + 1];
    std::int64_t lowest = voxel_index(samples.place[begin], 2);
    std::int64_t highest = lowest;
    for (std::uint32_t s = begin; s < end; ++s) {
      lowest = std::min(lowest, voxel_index(samples.place[s], 2));
      highest = std::max(highest, voxel_index(samples.place[s], 2));
    }
    Counts sum;
    for (std::uint32_t s = begin; s < end; ++s) {
      if (2 * voxel_index(samples.place[s], 2) > lowest + highest) continue;
      const Counts share =
          counts_of(beliefs.supervoxels[s], samples.sample_begin[s + 1] - samples.sample_begin[s]);
      sum.total += share.total;
      sum.moved += share.moved;
      sum.decided += share.decided;
    }
    return sum;
  }

  // Counts of one supervoxel with `samples` samples.
  Counts counts_of(const Belief& belief, std::uint32_t samples) const {
    const bool free = is_free(belief);
    return {samples, free ? samples : 0, free || belief.occupied != 0 ? samples : 0};
  }

  // Only supervoxels with a free sample, or with a hit while they are open, may change: few, after
  // some references. All are prefetched before the first is used, since beliefs of older scans are
  // not in the cache.
  void update_supervoxels(const InstanceSamples& samples, const detail::Visibility& visibility,
                          InstanceBeliefs& beliefs) {
    const std::size_t count = find_touched(samples, visibility, beliefs);
    for (std::size_t i = 0; i < count; ++i) {
      update_supervoxel(samples, visibility, touched_[i], beliefs);
    }
  }

  // Lists them in `touched_`, in order, and returns their number.
  std::size_t find_touched(const InstanceSamples& samples, const detail::Visibility& visibility,
                           const InstanceBeliefs& beliefs) {
    constexpr std::size_t kBits = 64;
    detail::grow(touched_, samples.supervoxel_count() + 1);
    std::size_t count = 0;
    std::uint32_t last = kNoCluster;
    for (std::size_t begin = 0; begin < samples.size(); begin += kBits) {
      std::uint64_t seen =
          visibility.free_word(begin) | (visibility.hit_word(begin) & beliefs.open[begin / kBits]);
      const std::size_t left = samples.size() - begin;
      if (left < kBits) seen &= (std::uint64_t{1} << left) - 1;
      detail::for_each_bit(seen, [&](std::size_t i) {
        const std::uint32_t s = samples.supervoxel_of[begin + i];
        touched_[count] = s;
        count += s != last ? 1 : 0;
        last = s;
        __builtin_prefetch(&beliefs.supervoxels[s]);
        __builtin_prefetch(&samples.sample_begin[s]);
        __builtin_prefetch(&samples.instance_of[s]);
      });
    }
    return count;
  }

  void update_supervoxel(const InstanceSamples& samples, const detail::Visibility& visibility,
                         std::uint32_t s, InstanceBeliefs& beliefs) const {
    const std::uint32_t begin = samples.sample_begin[s];
    const std::uint32_t end = samples.sample_begin[s + 1];
    Belief& belief = beliefs.supervoxels[s];
    const bool was_open = is_open(belief);
    const Counts before = counts_of(belief, end - begin);
    const bool changed = update(belief, visibility.count(begin, end), end - begin);
    if (is_open(belief) != was_open) flip_open(samples, s, beliefs);
    if (!changed) return;
    const std::uint32_t instance = samples.instance_of[s];
    Counts& share = beliefs.counts[instance];
    const Counts now = counts_of(belief, end - begin);
    share.moved += now.moved - before.moved;
    share.decided += now.decided - before.decided;
    beliefs.changed[instance] = 1;
  }

  // Whether hits may change it: not if it is occupied and its level is zero.
  static bool is_open(const Belief& belief) { return belief.occupied == 0 || belief.level > 0.0F; }
  static void flip_open(const InstanceSamples& samples, std::uint32_t s, InstanceBeliefs& beliefs) {
    std::uint32_t begin = samples.sample_begin[s];
    const std::uint32_t end = samples.sample_begin[s + 1];
    while (begin < end) {
      const std::uint32_t last = std::min(end - 1, begin | 63U);  // in the same word
      beliefs.open[begin / 64] ^= ~std::uint64_t{0} >> (63 - (last - begin)) << begin % 64;
      begin = last + 1;
    }
  }

  // Updates the beliefs on whole instances.
  template <class OnHit>
  void update_wholes(const InstanceSamples& samples, const detail::Visibility& visibility,
                     InstanceBeliefs& beliefs, OnHit&& on_hit) const {
    std::uint32_t end = 0;
    for (std::size_t instance = 0; instance < samples.instance_count(); ++instance) {
      const std::uint32_t begin = end;
      end += beliefs.counts[instance].total;
      const detail::Visibility::Count all = visibility.count(begin, end);
      const auto count = static_cast<float>(end - begin);
      const auto seen = static_cast<float>(all.free + all.hit);
      if (seen < std::max(2.0F, kLeastView * count)) continue;
      const float share = static_cast<float>(all.free) / seen;
      if (share >= pass_ratio_) {
        raise(beliefs.wholes[instance], share);
        beliefs.changed[instance] = 1;
      } else if (share <= detail::FreeSpaceSum::kHitRatio) {
        lower(beliefs.wholes[instance]);
        beliefs.changed[instance] = 1;
        const auto hits = static_cast<float>(all.hit);
        if (share <= 1.0F - kContradictingHits && hits >= kLeastKnown * count) on_hit(instance);
      }
    }
  }

  // Eq. 15 with three increments as in Eq. 18, by the ratio of free to visible samples; at least
  // one sample is visible. Ratios between the limits, and few free samples, change nothing. A
  // single hit contests free space, but does not make the place occupied. Returns whether a verdict
  // may change.
  bool update(Belief& belief, detail::Visibility::Count seen, std::uint32_t samples) const {
    const auto free = static_cast<float>(seen.free);
    const float share = free / static_cast<float>(seen.free + seen.hit);
    if (free >= kLeastFree * static_cast<float>(samples) &&
        share >= detail::FreeSpaceSum::kFreeRatio) {
      raise(belief, share);
      return true;
    }
    if (seen.hit == 0 || share > detail::FreeSpaceSum::kHitRatio) return false;
    const Belief before = belief;
    lower(belief);
    if (seen.hit >= std::max(std::min(2U, samples), (samples + kLeastHit - 1) / kLeastHit)) {
      belief.occupied = 1;
    }
    return belief.contested != before.contested || belief.occupied != before.occupied ||
           belief.hit_again != before.hit_again;
  }

  void raise(Belief& belief, float share) const {
    sum_.raise(belief.level, share);
    belief.peak = std::max(belief.peak, belief.level);
  }
  void lower(Belief& belief) const {
    belief.contested = 1;
    if (belief.level > 0.0F) belief.hit_again = 1;
    sum_.lower(belief.level);
  }

  float pass_ratio_;
  float removal_ratio_;
  detail::FreeSpaceSum sum_;
  float free_level_;
  float contested_level_;
  float whole_level_;
  std::vector<std::uint32_t> touched_;  // supervoxels that a reference may change
};

}  // namespace dynains
