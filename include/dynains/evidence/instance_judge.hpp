// Verdicts on the supervoxels of the instances of one scan.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/evidence/free_space_config.hpp"
#include "dynains/evidence/instance_beliefs.hpp"
#include "dynains/evidence/instance_samples.hpp"
#include "dynains/evidence/instance_tracks.hpp"
#include "dynains/verdict.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::detail {

/// Finds groups of supervoxels that are connected in the 26-neighbourhood.
class SupervoxelGroups {
 public:
  /// Removes supervoxels from `members` whose group has fewer than `min_samples` samples, and
  /// reorders the rest. `members`: supervoxels of one instance.
  void keep_large(const InstanceSamples& samples, std::size_t min_samples,
                  std::vector<std::uint32_t>& members) {
    if (members.empty()) return;
    places_.clear();
    numbers_.clear();
    for (const std::uint32_t member : members) {
      places_.push_back(samples.place[member]);
      numbers_.insert(places_.back());
    }
    kept_.clear();
    search_.for_each(places_, numbers_, [&](const std::vector<std::uint32_t>& group) {
      std::size_t count = 0;
      for (const std::uint32_t i : group) {
        count += samples.sample_begin[members[i] + 1] - samples.sample_begin[members[i]];
      }
      for (const std::uint32_t i : group) {
        if (count >= min_samples) kept_.push_back(members[i]);
      }
    });
    members.swap(kept_);
  }

 private:
  std::vector<VoxelKey> places_;
  VoxelHashTable<> numbers_;
  ComponentSearch search_;
  std::vector<std::uint32_t> kept_;
};

/// Evidence on the instances of one scan.
struct InstanceEvidence {
  InstanceSamples samples;
  InstanceBeliefs beliefs;
  TrackedInstances tracked;
};

/// Derives the verdicts on supervoxels from the evidence on their instances. Goes beyond the paper.
class InstanceJudge {
 public:
  using Verdict = EvidenceVerdict::Group;

  explicit InstanceJudge(const FreeSpaceConfig& config)
      : presume_dynamic_(config.presume_dynamic),
        removal_ratio_(static_cast<float>(config.removal_ratio)) {}

  /// Writes one verdict per supervoxel. `may_presume`: for provisional verdicts; allows kPresumed.
  void judge(const InstanceEvidence& evidence, const InstanceBeliefUpdater& updater,
             bool may_presume, std::vector<Verdict>& verdicts) {
    const InstanceSamples& samples = evidence.samples;
    verdicts.resize(samples.supervoxel_count());
    for (std::size_t instance = 0; instance < samples.instance_count(); ++instance) {
      const std::uint32_t first = samples.supervoxel_begin[instance];
      const std::uint32_t last = samples.supervoxel_begin[instance + 1];
      const float level = judge_alone(evidence.beliefs, updater, first, last, verdicts);
      const Cause whole = cause_of_whole(evidence, may_presume, instance);
      if (is_dynamic(whole)) {
        const Verdict verdict = {whole, as_probability(std::max(level, updater.free_level()))};
        for (std::uint32_t s = first; s < last; ++s) {
          if (!evidence.beliefs.supervoxels[s].stays()) verdicts[s] = verdict;
        }
      } else {
        // Only a part of the instance is dynamic; small groups of free samples may be noise.
        groups_.keep_large(samples, kMinGroup, free_);
      }
      for (const std::uint32_t s : free_) verdicts[s].cause = Cause::kFreeSpace;
    }
  }

  /// Whether a supervoxel with verdict `cause` is dynamic with high certainty. A free part of its
  /// instance is not sufficient: the instance may be foliage, or may include a static object beside
  /// a dynamic one.
  bool surely_moves(const InstanceEvidence& evidence, std::uint32_t supervoxel, Cause cause) const {
    if (cause == Cause::kFreeSpace || cause == Cause::kDynamicOccupancy) return true;
    if (!is_dynamic(cause) || cause == Cause::kPresumed) return false;
    const std::uint32_t instance = evidence.samples.instance_of[supervoxel];
    return moved_ratio(evidence, instance) >= kSurelyMoved;
  }

 private:
  static constexpr std::size_t kMinGroup = 4;  // samples
  static constexpr float kSurelyMoved = 0.7F;  // ratio of moved to decided samples of a track

  static float moved_ratio(const InstanceEvidence& evidence, std::size_t instance) {
    return evidence.tracked.instances[instance].moved_ratio(evidence.beliefs.counts[instance]);
  }

  // Writes static verdicts for supervoxels [first, last) and lists the free ones in `free_`.
  // Returns the largest log-odds of them.
  float judge_alone(const InstanceBeliefs& beliefs, const InstanceBeliefUpdater& updater,
                    std::uint32_t first, std::uint32_t last, std::vector<Verdict>& verdicts) {
    free_.clear();
    float level = 0.0F;
    for (std::uint32_t s = first; s < last; ++s) {
      const InstanceBeliefs::Belief& belief = beliefs.supervoxels[s];
      level = std::max(level, belief.peak);
      verdicts[s] = {cause_to_stay(belief), as_probability(belief.peak)};
      if (updater.is_free(belief)) free_.push_back(s);
    }
    return level;
  }

  static Cause cause_to_stay(const InstanceBeliefs::Belief& belief) {
    if (belief.peak > 0.0F) return Cause::kTooLittleFree;
    return belief.contested != 0 ? Cause::kOccupied : Cause::kNoEvidence;
  }

  // Cause to remove an instance as a whole, or kNoEvidence: enough of the decided samples along its
  // track are free, in this scan or in others.
  Cause cause_of_whole(const InstanceEvidence& evidence, bool may_presume,
                       std::size_t instance) const {
    if (moved_ratio(evidence, instance) >= removal_ratio_) {
      return evidence.beliefs.counts[instance].moved > 0 ? Cause::kWithInstance
                                                         : Cause::kAlongTrack;
    }
    return may_presume && is_presumed(evidence, instance) ? Cause::kPresumed : Cause::kNoEvidence;
  }

  // Whether a provisional verdict removes a compact instance without evidence: a moving vehicle
  // ahead, or a static object that came into view, as are most of those that are tracked longer.
  bool is_presumed(const InstanceEvidence& evidence, std::size_t instance) const {
    constexpr std::uint32_t kMinSamples = 5;
    constexpr std::uint32_t kMaxAge = 4;  // scans
    constexpr float kMaxDecided = 0.1F;   // ratio to all samples
    const TrackedInstances::Shape& shape = evidence.tracked.shapes[instance];
    if (!presume_dynamic_ || !shape.carried || shape.age > kMaxAge) return false;
    const InstanceBeliefs::Counts& counts = evidence.beliefs.counts[instance];
    return counts.total >= kMinSamples &&
           static_cast<float>(counts.decided) <= kMaxDecided * static_cast<float>(counts.total);
  }

  // Avoids the exponential for log-odds of 0, which are frequent.
  static float as_probability(float level) {
    return level == 0.0F ? 0.5F : 1.0F / (1.0F + std::exp(-level));
  }

  bool presume_dynamic_;
  float removal_ratio_;
  SupervoxelGroups groups_;
  std::vector<std::uint32_t> free_;  // free supervoxels of the current instance
};

}  // namespace dynains::detail
