// Free-space beliefs of the supervoxels and the instances of one scan.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/belief/log_odds.hpp"
#include "dynains/evidence/free_space_config.hpp"
#include "dynains/evidence/instance_samples.hpp"
#include "dynains/evidence/instance_views.hpp"
#include "dynains/evidence/visibility.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/bits.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

/// Beliefs on the samples of one scan.
struct InstanceBeliefs {
  /// Log-odds that a supervoxel was free, a FreeSpaceSum. Thin objects, which some beams pass, have
  /// too many hits for the sum to grow.
  struct Belief {
    float level = 0.0F;  ///< log-odds by the references of one side of time, >= 0
    float peak = 0.0F;   ///< maximum of `level` that hits cannot take back, over both sides of time
    std::uint8_t contested = 0;  ///< 1 after a reference with mostly hits
    std::uint8_t occupied = 0;   ///< 1 after a reference with hits on enough samples
    std::uint8_t turns = 0;  ///< number of changes from hit to free and back; odd while it is free

    float highest() const { return std::max(peak, level); }
  };
  /// Numbers of samples of an instance, or of a part of it.
  struct Counts {
    std::uint32_t total = 0;
    std::uint32_t moved = 0;    ///< in free supervoxels
    std::uint32_t decided = 0;  ///< in free or occupied supervoxels

    /// Whether enough samples are known, and none of them moved.
    bool stands_still() const {
      return moved == 0 && static_cast<float>(decided) >= kLeastKnown * static_cast<float>(total);
    }
  };
  /// Least ratio of known to all samples of an instance for evidence that it stands still.
  static constexpr float kLeastKnown = 0.3F;

  std::vector<Belief> supervoxels;
  std::vector<Counts> counts;  ///< by instance
  InstanceViews views;
  std::vector<std::uint8_t> merged;   ///< by instance: 1 if larger than one object; the caller's
  std::vector<std::uint64_t> open;    ///< bit by sample: a hit may change its supervoxel's belief
  std::vector<std::uint8_t> changed;  ///< by instance: 1 if a belief changed; the caller resets it
};

/// Updates beliefs by the visibility of samples from reference scans, and evaluates them.
class InstanceBeliefUpdater {
 public:
  using Belief = InstanceBeliefs::Belief;
  using Counts = InstanceBeliefs::Counts;

  explicit InstanceBeliefUpdater(const FreeSpaceConfig& config)
      : removal_ratio_(static_cast<float>(config.removal_ratio)),
        large_removal_ratio_(static_cast<float>(config.large_removal_ratio)),
        sum_(config.p_free, config.p_hit),
        free_level_(static_cast<float>(log_odds(config.tau_free))),
        contested_level_(static_cast<float>(log_odds(config.tau_contested))) {}

  /// Log-odds increment of one reference with free samples, l(p_free).
  float increment() const { return sum_.increment(); }
  /// Log-odds from which a supervoxel without hits was free, l(tau_free).
  float free_level() const { return free_level_; }

  /// Resets the beliefs for the samples of a new scan.
  void begin(const InstanceSamples& samples, InstanceBeliefs& out) const {
    const std::size_t instances = samples.instance_count();
    out.supervoxels.assign(samples.supervoxel_count(), Belief());
    out.changed.assign(instances, 1);
    out.merged.assign(instances, 0);
    out.counts.resize(instances);
    for (std::size_t instance = 0; instance < instances; ++instance) {
      out.counts[instance] = {samples.count(instance), 0, 0};
    }
    out.views.begin(samples);
    out.open.assign(samples.size() / 64 + 1, ~std::uint64_t{0});
  }

  /// Restarts the sums for the references on the other side of time; keeps the peaks.
  void begin_later_references(const InstanceSamples& samples, InstanceBeliefs& beliefs) const {
    for (std::uint32_t s = 0; s < beliefs.supervoxels.size(); ++s) {
      Belief& belief = beliefs.supervoxels[s];
      if (belief.occupied != 0 && belief.level > 0.0F) flip_open(samples, s, beliefs);
      belief.peak = belief.highest();
      belief.level = 0.0F;
      belief.turns &= static_cast<std::uint8_t>(~1U);
    }
  }

  /// Updates the beliefs by the visibility of `samples` from one reference. `reference`: its
  /// position, m, in the sensor frame of the scan. Calls `on_hit(instance)` for each instance with
  /// enough visible samples of which nearly all are hit.
  template <class OnHit>
  void update(const InstanceSamples& samples, const Visibility& visibility,
              const InstanceViews::Position& reference, InstanceBeliefs& beliefs, OnHit&& on_hit) {
    beliefs.views.look_from(reference);
    // AVX2 processors have instructions that find and count bits.
    with_packs([&](auto) {
      update_instances(samples, visibility, beliefs, on_hit);
      update_supervoxels(samples, visibility, beliefs);
    });
  }

  /// Whether a supervoxel was free. A place that was hit again after it was free, twice, is one
  /// that beams pass by chance, such as foliage.
  bool is_free(const Belief& belief) const {
    return belief.turns < kTurnsByChance &&
           belief.highest() >= (belief.contested != 0 ? contested_level_ : free_level_);
  }

  /// Whether an instance is dynamic as a whole: enough of its decided samples are free. `is_large`:
  /// larger than one object; large_removal_ratio of its samples must be free.
  bool removes_whole(const InstanceBeliefs& beliefs, std::size_t instance, bool is_large) const {
    const Counts& counts = beliefs.counts[instance];
    const float ratio = is_large ? large_removal_ratio_ : removal_ratio_;
    return counts.moved > 0 &&
           static_cast<float>(counts.moved) >= ratio * static_cast<float>(counts.decided);
  }

 private:
  static constexpr float kLeastVisible = 0.25F;       // ratio of visible samples of an instance
  static constexpr float kPartWeight = 0.5F;          // of a reference that passes a small part
  static constexpr std::uint8_t kTurnsByChance = 4;   // hit, free, hit, free, hit
  static constexpr float kContradictingHits = 0.85F;  // ratio of hits to visible samples
  // A supervoxel is occupied if at least two of its samples and one of kSamplesPerHit are hit.
  static constexpr std::uint32_t kSamplesPerHit = 4;

  // Counts of one supervoxel with `samples` samples.
  Counts counts_of(const Belief& belief, std::uint32_t samples) const {
    const bool free = is_free(belief);
    return {samples, free ? samples : 0, free || belief.occupied != 0 ? samples : 0};
  }

  // Only supervoxels with a free sample, or with a hit while they are open, can change. Their
  // number is small after the first references. The beliefs of all of them are prefetched before
  // the first update, since beliefs of older scans are not in the cache.
  void update_supervoxels(const InstanceSamples& samples, const Visibility& visibility,
                          InstanceBeliefs& beliefs) {
    const std::size_t count = find_touched(samples, visibility, beliefs);
    for (std::size_t i = 0; i < count; ++i) {
      update_supervoxel(samples, visibility, touched_[i], beliefs);
    }
  }

  // Writes the supervoxels that can change to `touched_`, in ascending order; returns their number.
  std::size_t find_touched(const InstanceSamples& samples, const Visibility& visibility,
                           const InstanceBeliefs& beliefs) {
    constexpr std::size_t kBits = InstanceSamples::kWord;
    grow(touched_, samples.supervoxel_count() + 1);
    std::size_t count = 0;
    std::uint32_t last = kNoCluster;
    for (std::size_t begin = 0; begin < samples.size(); begin += kBits) {
      std::uint64_t touched =
          visibility.free_word(begin) | (visibility.hit_word(begin) & beliefs.open[begin / kBits]);
      const std::size_t left = samples.size() - begin;
      if (left < kBits) touched &= (std::uint64_t{1} << left) - 1;
      const std::uint64_t begins = samples.begins[begin / kBits];
      while (touched != 0) {
        const std::uint64_t above = ~std::uint64_t{1} << __builtin_ctzll(touched);
        const std::uint32_t s =
            samples.supervoxels_before[begin / kBits] + count_ones(begins & ~above) - 1;
        touched_[count] = s;
        count += s != last ? 1 : 0;
        last = s;
        __builtin_prefetch(&beliefs.supervoxels[s]);
        __builtin_prefetch(&samples.sample_begin[s]);
        __builtin_prefetch(&samples.instance_of[s]);
        const std::uint64_t next = begins & above & (~(begins & above) + 1);  // begin after s, or 0
        touched &= ~next + 1;
      }
    }
    return count;
  }

  void update_supervoxel(const InstanceSamples& samples, const Visibility& visibility,
                         std::uint32_t s, InstanceBeliefs& beliefs) const {
    const std::uint32_t begin = samples.sample_begin[s];
    const std::uint32_t end = samples.sample_begin[s + 1];
    Belief& belief = beliefs.supervoxels[s];
    const bool was_open = is_open(belief);
    const Counts before = counts_of(belief, end - begin);
    const std::uint32_t instance = samples.instance_of[s];
    const bool changed =
        update(belief, visibility.count(begin, end), end - begin, weight_of_free_[instance]);
    if (is_open(belief) != was_open) flip_open(samples, s, beliefs);
    if (!changed) return;
    Counts& counts = beliefs.counts[instance];
    const Counts now = counts_of(belief, end - begin);
    counts.moved += now.moved - before.moved;
    counts.decided += now.decided - before.decided;
    beliefs.changed[instance] = 1;
  }

  // Whether hits can change the belief.
  static bool is_open(const Belief& belief) { return belief.occupied == 0 || belief.level > 0.0F; }
  static void flip_open(const InstanceSamples& samples, std::uint32_t s, InstanceBeliefs& beliefs) {
    std::uint32_t begin = samples.sample_begin[s];
    const std::uint32_t end = samples.sample_begin[s + 1];
    while (begin < end) {
      const std::uint32_t last = std::min(end - 1, begin | 63U);  // last bit in this word
      beliefs.open[begin / 64] ^= ~std::uint64_t{0} >> (63 - (last - begin)) << begin % 64;
      begin = last + 1;
    }
  }

  // Updates what is known of whole instances.
  template <class OnHit>
  void update_instances(const InstanceSamples& samples, const Visibility& visibility,
                        InstanceBeliefs& beliefs, OnHit&& on_hit) {
    grow(weight_of_free_, samples.instance_count());
    std::uint32_t end = 0;
    for (std::size_t instance = 0; instance < samples.instance_count(); ++instance) {
      const std::uint32_t begin = end;
      end += beliefs.counts[instance].total;
      const Visibility::Count all = visibility.count(begin, end);
      const auto count = static_cast<float>(end - begin);
      const auto visible = static_cast<float>(all.free + all.hit);
      const float least = kLeastVisible * count;
      const float free_ratio = visible >= least ? static_cast<float>(all.free) / visible : 0.0F;
      const bool is_hit = free_ratio <= FreeSpaceSum::kHitRatio;
      weight_of_free_[instance] = beliefs.views.is_contradicted(instance)   ? 0.0F
                                  : is_hit && beliefs.merged[instance] == 0 ? kPartWeight
                                                                            : 1.0F;
      if (visible < std::max(2.0F, least)) continue;
      beliefs.views.add(instance, free_ratio);
      const auto hits = static_cast<float>(all.hit);
      if (free_ratio <= 1.0F - kContradictingHits && hits >= InstanceBeliefs::kLeastKnown * count) {
        on_hit(instance);
      }
    }
  }

  // Updates the belief on a supervoxel by one reference (Eq. 15), with `samples` samples and at
  // least one visible sample. No change if the ratio of free to visible samples lies between the
  // limits of FreeSpaceSum. `weight`: of free samples. Those of a reference that mostly hits an
  // instance, or sees little of it, may lie at an edge of a standing object, if the instance is not
  // larger than one object: they count half, and later hits take them back. A single hit sets
  // `contested`, but not `occupied`. Returns whether a verdict may change.
  bool update(Belief& belief, Visibility::Count visible, std::uint32_t samples,
              float weight) const {
    const auto free = static_cast<float>(visible.free);
    const float free_ratio = free / static_cast<float>(visible.free + visible.hit);
    if (free_ratio >= FreeSpaceSum::kFreeRatio) {
      if (weight <= 0.0F) return false;
      belief.turns |= 1U;
      sum_.raise(belief.level, free_ratio, weight);
      if (weight >= 1.0F) belief.peak = std::max(belief.peak, belief.level);
      return true;
    }
    if (visible.hit == 0 || free_ratio > FreeSpaceSum::kHitRatio) return false;
    const Belief before = belief;
    belief.contested = 1;
    sum_.lower(belief.level);
    if (belief.turns % 2 != 0 && belief.turns < kTurnsByChance) ++belief.turns;
    const std::uint32_t least_hits = (samples + kSamplesPerHit - 1) / kSamplesPerHit;
    if (visible.hit >= std::max(std::min(2U, samples), least_hits)) belief.occupied = 1;
    return belief.contested != before.contested || belief.occupied != before.occupied ||
           belief.level != before.level || belief.turns != before.turns;
  }

  float removal_ratio_;
  float large_removal_ratio_;
  FreeSpaceSum sum_;
  float free_level_;
  float contested_level_;
  std::vector<float> weight_of_free_;   // by instance: of free samples of the current reference
  std::vector<std::uint32_t> touched_;  // supervoxels that the current reference can change
};

}  // namespace dynains::detail
