// What references say of the instances of one scan, as belief per supervoxel and per instance.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/belief_updater.hpp"
#include "dynains/evidence/free_space_sum.hpp"
#include "dynains/evidence/instance_samples.hpp"
#include "dynains/evidence/visibility.hpp"
#include "dynains/simd/bits.hpp"
#include "dynains/simd/capacity.hpp"
#include "dynains/simd/wide_lanes.hpp"
#include "dynains/stage/free_space_config.hpp"

namespace dynains {

/// Beliefs on the samples of one scan.
struct InstanceBeliefs {
  /// That a place was free: a log-odds sum that starts again whenever it falls to zero (Page's test
  /// for a change, 1954). A place that is hit for long and then seen free has changed, and hits
  /// never cancel what was seen free; yet thin things, which single beams miss, are hit too often
  /// in between for the sum to grow.
  struct Belief {
    float level = 0.0F;          ///< of the references summed up now; never negative
    float peak = 0.0F;           ///< the highest it was
    std::uint8_t contested = 0;  ///< whether some reference hit any of the place
    std::uint8_t occupied = 0;   ///< whether some reference hit enough of it to say what it was
    std::uint8_t hit_again = 0;  ///< whether one hit it beyond others that had seen it free
  };
  /// Samples of an instance.
  struct Share {
    std::uint32_t total = 0;
    std::uint32_t moved = 0;    ///< in supervoxels that were free
    std::uint32_t decided = 0;  ///< in supervoxels of which anything is known
  };

  std::vector<Belief> supervoxels;
  std::vector<Belief> wholes;         ///< by instance, of all its samples together
  std::vector<Share> shares;          ///< by instance
  std::vector<std::uint64_t> open;    ///< by sample, a bit: whether a hit may change its belief
  std::vector<std::uint8_t> changed;  ///< by instance: whether any of this did; for the caller
};

/// Takes in what references see, and says what follows from it.
class InstanceBeliefUpdater {
 public:
  using Belief = InstanceBeliefs::Belief;
  using Share = InstanceBeliefs::Share;

  static constexpr float kLeastKnown = 0.3F;  ///< share of an instance, to say that it stands still

  explicit InstanceBeliefUpdater(const FreeSpaceConfig& config)
      : pass_ratio_(static_cast<float>(config.pass_ratio)),
        removal_ratio_(static_cast<float>(config.removal_ratio)),
        sum_(config.p_free, config.p_hit),
        free_level_(static_cast<float>(log_odds(config.tau_free))),
        contested_level_(static_cast<float>(log_odds(config.tau_contested))),
        whole_level_(static_cast<float>(log_odds(config.tau_whole))) {}

  /// Log-odds of one observation of free space.
  float increment() const { return sum_.increment(); }
  /// Log-odds from which a place that no reference hit was free.
  float free_level() const { return free_level_; }

  /// Nothing is known yet.
  void begin(const InstanceSamples& samples, InstanceBeliefs& out) const {
    const std::size_t instances = samples.instance_count();
    out.supervoxels.assign(samples.supervoxel_count(), Belief());
    out.wholes.assign(instances, Belief());
    out.changed.assign(instances, 1);
    out.shares.resize(instances);
    for (std::size_t instance = 0; instance < instances; ++instance) {
      out.shares[instance] = {samples.count(instance), 0, 0};
    }
    out.open.assign(samples.size() / 64 + 1, ~std::uint64_t{0});
  }

  /// What follows is summed apart from what was before.
  void begin_other_side(const InstanceSamples& samples, InstanceBeliefs& beliefs) const {
    for (std::uint32_t s = 0; s < beliefs.supervoxels.size(); ++s) {
      Belief& belief = beliefs.supervoxels[s];
      if (belief.occupied != 0 && belief.level > 0.0F) flip_open(samples, s, beliefs);
      belief.level = 0.0F;
    }
    for (Belief& belief : beliefs.wholes) belief.level = 0.0F;
  }

  /// Takes in what one reference saw of the samples. Calls `on_hit(instance)` for those of which
  /// enough was seen, and nearly all of it still there.
  template <class OnHit>
  void update(const InstanceSamples& samples, const detail::Visibility& visibility,
              InstanceBeliefs& beliefs, OnHit&& on_hit) {
    // Processors with wide lanes find and count bits by one instruction.
    detail::run_packs([&](auto) {
      update_supervoxels(samples, visibility, beliefs);
      update_wholes(samples, visibility, beliefs, on_hit);
    });
  }

  bool is_free(const Belief& belief) const {
    return belief.peak >= (belief.contested != 0 ? contested_level_ : free_level_);
  }

  /// Whether an instance was seen through as a whole, or enough of what is known of it was free. If
  /// less than half of that was, and some was hit again, enough of its lower half must be, too,
  /// unless little is known of that: beams pass the windows of what stands there at some angles,
  /// but not what carries them.
  bool removes_whole(const InstanceSamples& samples, const InstanceBeliefs& beliefs,
                     std::size_t instance) const {
    const Share& share = beliefs.shares[instance];
    const Belief& whole = beliefs.wholes[instance];
    const bool seen_through = whole.peak >= (whole.contested != 0 ? whole_level_ : free_level_);
    if (!seen_through && !is_enough(share)) return false;
    if (2 * share.moved >= share.decided) return true;
    const bool hit_again =
        seen_through ? whole.hit_again != 0 : was_hit_again(samples, beliefs, instance);
    if (!hit_again) return true;
    const Share lower_half = share_of_lower_half(samples, beliefs, instance);
    return lower_half.decided < kLeastBody || is_enough(lower_half);
  }

 private:
  static constexpr float kLeastView = 0.25F;       // share of an instance that a reference must see
  static constexpr float kLeastFree = 0.15F;       // share of a supervoxel that must be seen free
  static constexpr std::uint32_t kLeastBody = 12;  // known samples of what could carry windows
  static constexpr float kContradictingHits = 0.85F;  // of what is seen of an instance
  // Two samples of a supervoxel must be hit, and one of so many, for it to be occupied.
  static constexpr std::uint32_t kLeastHit = 4;

  bool is_enough(const Share& share) const {
    return share.moved > 0 &&
           static_cast<float>(share.moved) >= removal_ratio_ * static_cast<float>(share.decided);
  }

  // Whether any supervoxel of an instance was hit again that counts as free.
  bool was_hit_again(const InstanceSamples& samples, const InstanceBeliefs& beliefs,
                     std::size_t instance) const {
    const auto* const all = beliefs.supervoxels.data();
    return std::any_of(
        all + samples.supervoxel_begin[instance], all + samples.supervoxel_begin[instance + 1],
        [&](const Belief& belief) { return belief.hit_again != 0 && is_free(belief); });
  }

  // Of the supervoxels that lie in the lower half of the layers of an instance.
  Share share_of_lower_half(const InstanceSamples& samples, const InstanceBeliefs& beliefs,
                            std::size_t instance) const {
    const std::uint32_t begin = samples.supervoxel_begin[instance];
    const std::uint32_t end = samples.supervoxel_begin[instance + 1];
    std::int64_t lowest = voxel_index(samples.place[begin], 2);
    std::int64_t highest = lowest;
    for (std::uint32_t s = begin; s < end; ++s) {
      lowest = std::min(lowest, voxel_index(samples.place[s], 2));
      highest = std::max(highest, voxel_index(samples.place[s], 2));
    }
    Share sum;
    for (std::uint32_t s = begin; s < end; ++s) {
      if (2 * voxel_index(samples.place[s], 2) > lowest + highest) continue;
      const Share share =
          share_of(beliefs.supervoxels[s], samples.sample_begin[s + 1] - samples.sample_begin[s]);
      sum.total += share.total;
      sum.moved += share.moved;
      sum.decided += share.decided;
    }
    return sum;
  }

  // Of one supervoxel, with so many samples.
  Share share_of(const Belief& belief, std::uint32_t samples) const {
    const bool free = is_free(belief);
    return {samples, free ? samples : 0, free || belief.occupied != 0 ? samples : 0};
  }

  // What the reference saw may change supervoxels of which something was seen free, or was hit
  // while they are open: few, once a scan has met some references. All are asked for before the
  // first is needed: what is known of an older scan lies far away by now.
  void update_supervoxels(const InstanceSamples& samples, const detail::Visibility& visibility,
                          InstanceBeliefs& beliefs) {
    const std::size_t count = find_touched(samples, visibility, beliefs);
    for (std::size_t i = 0; i < count; ++i) {
      update_supervoxel(samples, visibility, touched_[i], beliefs);
    }
  }

  // Leaves their numbers in `touched_`, in order, and returns how many there are.
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
    const Share before = share_of(belief, end - begin);
    const bool changed = update(belief, visibility.count(begin, end), end - begin);
    if (is_open(belief) != was_open) flip_open(samples, s, beliefs);
    if (!changed) return;
    const std::uint32_t instance = samples.instance_of[s];
    Share& share = beliefs.shares[instance];
    const Share now = share_of(belief, end - begin);
    share.moved += now.moved - before.moved;
    share.decided += now.decided - before.decided;
    beliefs.changed[instance] = 1;
  }

  // Whether hits may change it: what was occupied before and is not seen free stays as it is.
  static bool is_open(const Belief& belief) { return belief.occupied == 0 || belief.level > 0.0F; }
  static void flip_open(const InstanceSamples& samples, std::uint32_t s, InstanceBeliefs& beliefs) {
    std::uint32_t begin = samples.sample_begin[s];
    const std::uint32_t end = samples.sample_begin[s + 1];
    while (begin < end) {
      const std::uint32_t last = std::min(end - 1, begin | 63U);  // in this word
      beliefs.open[begin / 64] ^= ~std::uint64_t{0} >> (63 - (last - begin)) << begin % 64;
      begin = last + 1;
    }
  }

  // Whether the reference saw through whole instances.
  template <class OnHit>
  void update_wholes(const InstanceSamples& samples, const detail::Visibility& visibility,
                     InstanceBeliefs& beliefs, OnHit&& on_hit) const {
    std::uint32_t end = 0;
    for (std::size_t instance = 0; instance < samples.instance_count(); ++instance) {
      const std::uint32_t begin = end;
      end += beliefs.shares[instance].total;
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

  // For something that was seen. Eq. 15 with three-way increments as in Eq. 18, by the share of
  // samples seen free; shares that say little, and few samples seen free, change nothing. A single
  // hit contests what others see free, but does not say that something stands there. Returns
  // whether anything changed that verdicts look at.
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
  std::vector<std::uint32_t> touched_;  // supervoxels of which a reference saw something
};

}  // namespace dynains
