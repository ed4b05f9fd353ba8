// Free-space beliefs of the supervoxels and the instances of one scan.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/belief/log_odds.hpp"
#include "dynains/evidence/free_space_config.hpp"
#include "dynains/evidence/instance_samples.hpp"
#include "dynains/evidence/visibility.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

/// Number of references whose hits show that a place or an instance is static. Chosen on random
/// worlds.
inline constexpr std::uint8_t kFirmHits = 7;

/// A static object hides the surfaces that a scan measured from other sides, and beams that graze
/// its edges pass them. So free samples of a reference on another side are no evidence where
/// references on the side of the scan hit the instance and none of them saw it free.
class InstanceViews {
 public:
  /// Forgets all references. Computes the centres of the instances of a new scan.
  void begin(const InstanceSamples& samples) {
    views_.assign(samples.instance_count(), View());
    std::uint32_t i = 0;
    for (std::size_t instance = 0; instance < views_.size(); ++instance) {
      View& view = views_[instance];
      view.count = static_cast<float>(samples.count(instance));
      for (const std::uint32_t end = i + samples.count(instance); i < end; ++i) {
        view.sum += Eigen::Vector3f(samples.points.x[i], samples.points.y[i], samples.points.z[i]);
      }
    }
  }

  /// Whether free samples of a reference on another side are no evidence on an instance.
  bool contradicts(std::size_t instance) const {
    return views_[instance].hits >= kFirmHits && !views_[instance].was_free;
  }

  /// Takes into account that a reference on the side of the scan sees enough of an instance.
  /// `free_ratio`: ratio of free to visible samples.
  void add(std::size_t instance, float free_ratio) {
    View& view = views_[instance];
    if (free_ratio <= FreeSpaceSum::kHitRatio && view.hits < kFirmHits) ++view.hits;
    if (free_ratio >= FreeSpaceSum::kFreeRatio) view.was_free = true;
  }

  /// Whether the directions from an instance to the sensor and to a reference differ by more than
  /// the largest angle of one side. `reference`: m, in the sensor frame of the scan.
  bool is_other_side(std::size_t instance, const Eigen::Vector3f& reference) const {
    const View& view = views_[instance];  // all vectors are scaled by the number of samples
    const Eigen::Vector3f other = view.sum - view.count * reference;
    return view.sum.dot(other) < kCosine * view.sum.norm() * other.norm();
  }

 private:
  static constexpr float kCosine = 0.9396926F;  // of 20 deg, the largest angle of one side

  struct View {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();  // of the samples, m, sensor frame
    float count = 0.0F;
    std::uint8_t hits = 0;  // references on the side of the scan that hit the instance
    bool was_free = false;  // a reference on the side of the scan saw the instance free
  };

  std::vector<View> views_;  // by instance
};

/// Beliefs on the samples of one scan.
struct InstanceBeliefs {
  /// Log-odds that a supervoxel was free, a FreeSpaceSum. Thin objects, which some beams pass, have
  /// too many hits for the sum to grow.
  struct Belief {
    float level = 0.0F;          ///< log-odds by the references so far, >= 0
    float peak = 0.0F;           ///< maximum of `level`
    std::uint8_t contested = 0;  ///< 1 after a reference with mostly hits
    std::uint8_t hits = 0;       ///< references with hits on enough samples, at most kFirmHits
    std::uint8_t turns = 0;  ///< number of changes from hit to free and back; odd while it is free
    /// As which Counts holds it. kStood is decided: hits alone change nothing but `hits`.
    enum class State : std::uint8_t { kUnknown, kDecided, kStood, kMoved };
    State counted = State::kUnknown;

    /// Whether it stays when its instance moves, since many references hit its place and none saw
    /// it free. An object that moves leaves its place earlier.
    bool stays() const { return hits >= kFirmHits && peak <= 0.0F; }
  };
  /// Numbers of samples of an instance, or of a part of it.
  struct Counts {
    std::uint32_t total = 0;
    std::uint32_t moved = 0;    ///< in free supervoxels
    std::uint32_t decided = 0;  ///< in free or occupied supervoxels

    std::uint32_t stood() const { return decided - moved; }
    /// Whether enough samples are known, and none of them moved.
    bool stands_still() const {
      constexpr float kMinKnown = 0.3F;  // ratio of known to all samples
      return moved == 0 && static_cast<float>(decided) >= kMinKnown * static_cast<float>(total);
    }
  };

  std::vector<Belief> supervoxels;
  std::vector<Counts> counts;  ///< by instance
  InstanceViews views;
};

/// Updates beliefs by the visibility of samples from reference scans, and evaluates them.
class InstanceBeliefUpdater {
 public:
  using Belief = InstanceBeliefs::Belief;
  using Counts = InstanceBeliefs::Counts;

  explicit InstanceBeliefUpdater(const FreeSpaceConfig& config)
      : sum_(config.p_free, config.p_hit),
        free_level_(static_cast<float>(log_odds(config.tau_free))),
        contested_level_(static_cast<float>(log_odds(config.tau_contested))) {}

  /// Log-odds from which a supervoxel without hits was free, l(tau_free).
  float free_level() const { return free_level_; }

  /// Resets the beliefs for the samples of a new scan.
  void begin(const InstanceSamples& samples, InstanceBeliefs& out) const {
    const std::size_t instances = samples.instance_count();
    out.supervoxels.assign(samples.supervoxel_count(), Belief());
    out.counts.resize(instances);
    for (std::size_t instance = 0; instance < instances; ++instance) {
      out.counts[instance] = {samples.count(instance), 0, 0};
    }
    out.views.begin(samples);
  }

  /// Updates the beliefs by the visibility of `samples` from one reference. `reference`: its
  /// position, m, in the sensor frame of the scan.
  void update(const InstanceSamples& samples, const Visibility& visibility,
              const Eigen::Vector3f& reference, InstanceBeliefs& beliefs) const {
    // AVX2 processors have an instruction that counts bits.
    with_packs([&](auto) {
      for (std::size_t instance = 0; instance < samples.instance_count(); ++instance) {
        const std::uint32_t last = samples.supervoxel_begin[instance + 1];
        std::uint32_t s = samples.supervoxel_begin[instance];
        std::uint32_t begin = samples.sample_begin[s];
        Counts& counts = beliefs.counts[instance];
        const auto all = visibility.count(begin, begin + counts.total);
        if (all.free + all.hit == 0) continue;
        const float weight = update_instance(all, reference, instance, beliefs);
        for (; s < last; ++s) {
          const std::uint32_t end = samples.sample_begin[s + 1];
          update_supervoxel(visibility.bits(begin, end), end - begin, weight,
                            beliefs.supervoxels[s], counts);
          begin = end;
        }
      }
    });
  }

  /// Whether a supervoxel was free. A place that was hit again after it was free, twice, is one
  /// that beams pass by chance, such as foliage.
  bool is_free(const Belief& belief) const {
    return belief.turns < kTurnsByChance &&
           belief.peak >= (belief.contested != 0 ? contested_level_ : free_level_);
  }

 private:
  static constexpr float kMinVisible = 0.25F;        // ratio of visible samples of an instance
  static constexpr float kPartWeight = 0.5F;         // of a reference that passes a small part
  static constexpr std::uint8_t kTurnsByChance = 4;  // hit, free, hit, free, hit

  // `visible`: its samples, at most Visibility::kMaxBits, which
  // FreeSpaceConfig::supervoxel_samples ensures. `weight`: of free samples, see update(). `counts`:
  // of its instance.
  void update_supervoxel(const Visibility::Bits& visible, std::uint32_t samples, float weight,
                         Belief& belief, Counts& counts) const {
    using State = Belief::State;
    if (visible.free == 0) {
      if (visible.hit == 0) return;
      if (belief.counted == State::kStood) return count_hits(belief, visible.count(), samples);
    }
    update(belief, visible.count(), samples, weight);
    const State before = belief.counted;
    belief.counted = state_of(belief);
    if (belief.counted == before) return;
    if (before == State::kMoved) counts.moved -= samples;
    if (belief.counted == State::kMoved) counts.moved += samples;
    if (before == State::kUnknown) counts.decided += samples;
    if (belief.counted == State::kUnknown) counts.decided -= samples;
  }

  Belief::State state_of(const Belief& belief) const {
    if (is_free(belief)) return Belief::State::kMoved;
    if (belief.hits == 0) return Belief::State::kUnknown;
    const bool may_turn = belief.turns % 2 != 0 && belief.turns < kTurnsByChance;
    return may_turn || belief.peak > 0.0F ? Belief::State::kDecided : Belief::State::kStood;
  }

  static void count_hits(Belief& belief, Visibility::Count visible, std::uint32_t samples) {
    if (visible.hit >= std::min(2U, samples) && belief.hits < kFirmHits) ++belief.hits;
  }

  // Updates what is known of an instance as a whole. `all`: its visible samples, at least one.
  // Returns the weight of the free ones.
  float update_instance(const Visibility::Count& all, const Eigen::Vector3f& reference,
                        std::size_t instance, InstanceBeliefs& beliefs) const {
    const auto visible = static_cast<float>(all.free + all.hit);
    const float least = kMinVisible * static_cast<float>(beliefs.counts[instance].total);
    const float free_ratio = visible >= least ? static_cast<float>(all.free) / visible : 0.0F;
    const bool is_hit = free_ratio <= FreeSpaceSum::kHitRatio;
    const float weight = is_hit ? kPartWeight : 1.0F;
    if (beliefs.views.is_other_side(instance, reference)) {
      return beliefs.views.contradicts(instance) ? 0.0F : weight;
    }
    if (visible >= std::max(2.0F, least)) beliefs.views.add(instance, free_ratio);
    return weight;
  }

  // Updates the belief on a supervoxel by one reference (Eq. 15), with `samples` samples and at
  // least one visible sample. No change if the ratio of free to visible samples lies between the
  // limits of FreeSpaceSum. `weight`: of free samples. Those of a reference that mostly hits an
  // instance, or sees little of it, may lie at an edge of a standing object: they count half. A
  // single hit sets `contested`, but does not count in `hits`.
  void update(Belief& belief, Visibility::Count visible, std::uint32_t samples,
              float weight) const {
    const auto free = static_cast<float>(visible.free);
    const float free_ratio = free / static_cast<float>(visible.free + visible.hit);
    if (free_ratio >= FreeSpaceSum::kFreeRatio) {
      if (weight <= 0.0F) return;
      belief.turns |= 1U;
      sum_.raise(belief.level, free_ratio, weight);
      belief.peak = std::max(belief.peak, belief.level);
      return;
    }
    if (free_ratio > FreeSpaceSum::kHitRatio) return;
    belief.contested = 1;
    sum_.lower(belief.level);
    if (belief.turns % 2 != 0 && belief.turns < kTurnsByChance) ++belief.turns;
    count_hits(belief, visible, samples);
  }

  FreeSpaceSum sum_;
  float free_level_;
  float contested_level_;
};

}  // namespace dynains::detail
