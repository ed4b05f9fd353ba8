// Free-space evidence: a beam of another scan that passed through the place of a point shows that
// the point was part of something that moved. Free space says where something moved; instances say
// what to remove whole. Goes beyond the paper, in the form of its belief (Eq. 15-19).
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/belief_updater.hpp"
#include "dynains/detail/lanes.hpp"
#include "dynains/free_space_config.hpp"
#include "dynains/ground_footprint.hpp"
#include "dynains/ground_segmenter.hpp"
#include "dynains/instance_samples.hpp"
#include "dynains/points.hpp"
#include "dynains/range_image.hpp"
#include "dynains/sensor_model.hpp"

namespace dynains {

/// Tests samples of each scan against range images of scans before and after it, and accumulates
/// what they show as belief per supervoxel.
///
/// The belief is a log-odds sum that starts again whenever it falls to zero (Page's test for a
/// change, 1954): a place that is hit for long and then seen free has changed, and hits never
/// cancel what was seen free; yet thin things, which single beams miss, are hit too often in
/// between for the sum to grow. References before and after the scan are summed apart.
class FreeSpaceEvidence {
 public:
  using Config = FreeSpaceConfig;

  /// Scans back and ahead that are looked at: dense near the scan, sparse far from it.
  static constexpr std::array<int, 19> kLags = {2,  4,  6,  8,  10, 13, 16,  20,  25, 30,
                                                40, 50, 65, 80, 100, 125, 150, 175, 200};

  FreeSpaceEvidence() : FreeSpaceEvidence(Config()) {}

  /// Throws ConfigError.
  explicit FreeSpaceEvidence(const Config& config)
      : config_((config.validate(), config)),
        sampler_(config.sample_size, config.supervoxel, config.evidence_range),
        ground_sampler_(config.ground_sample, config.ground_sample, config.evidence_range),
        footprint_(std::max(config.footprint, 0.05), config.evidence_range),
        reach_(std::max(config.ground_reach, 0.5), config.evidence_range),
        increment_(static_cast<float>(log_odds(config.p_free))),
        decrement_(static_cast<float>(log_odds(config.p_hit))),
        free_level_(static_cast<float>(log_odds(config.tau_free))),
        contested_level_(static_cast<float>(log_odds(config.tau_contested))),
        views_(static_cast<std::size_t>(std::max(config.memory, config.horizon)) + 1),
        records_(static_cast<std::size_t>(config.horizon) + 1) {}

  const Config& config() const { return config_; }

  /// Scans after which a verdict is final.
  std::size_t horizon() const { return static_cast<std::size_t>(config_.horizon); }

  /// Chooses the resolution of range images; to be called once before the first scan.
  void adapt(const SensorModel& sensor) { grid_ = RangeImageGrid::for_sensor(sensor); }

  /// Takes scan number `scan` in: scans come in order, from 0. `instance_of` holds the instance of
  /// each non-ground point of `split`, below `instance_count` or kNoCluster. Only scans of the
  /// same `segment` are compared.
  void observe(std::uint64_t scan, std::uint64_t segment, const Eigen::Isometry3d& T_world_sensor,
               const GroundSplit& split, Span<const std::uint32_t> instance_of,
               std::size_t instance_count) {
    newest_ = scan;
    View& view = views_[scan % views_.size()];
    view.segment = segment;
    view.T_world_sensor = T_world_sensor;
    view.image.build(grid_, PointsView(split.points).subview(0, split.count), image_scratch_);

    Record& record = records_[scan % records_.size()];
    record.segment = segment;
    record.T_world_sensor = T_world_sensor;
    sampler_.sample(split.non_ground(), instance_of, instance_count, record.samples);
    record.beliefs.assign(record.samples.supervoxel_count(), Belief());
    record.seen_through.assign(instance_count, 0);

    for (const int lag : kLags) {
      const auto back = static_cast<std::uint64_t>(lag);
      if (lag > config_.memory || back > scan) break;
      const View& reference = views_[(scan - back) % views_.size()];
      if (reference.segment == segment) refer(record, reference);
    }
    // What follows is summed apart from what was before.
    for (Belief& belief : record.beliefs) belief.level = 0.0F;
    for (const int lag : kLags) {
      const auto back = static_cast<std::uint64_t>(lag);
      if (lag > config_.horizon || back > scan) break;
      Record& older = records_[(scan - back) % records_.size()];
      if (older.segment == segment) refer(older, view);
    }
  }

  /// Verdict on a scan that is at most `horizon()` old, as the evidence stands now: by point of
  /// `split`, whether it moved, and the belief that it did.
  void judge(std::uint64_t scan, const GroundSplit& split, std::vector<std::uint8_t>& dynamic,
             std::vector<float>& belief) {
    const Record& record = records_[scan % records_.size()];
    judge_instances(record);
    dynamic.resize(split.count);
    belief.resize(split.count);
    std::fill_n(dynamic.begin(), split.ground_count, std::uint8_t{0});
    std::fill_n(belief.begin(), split.ground_count, 0.0F);
    const PointsView points = split.points;
    for (std::size_t i = split.ground_count; i < split.count; ++i) {
      const std::uint32_t supervoxel = record.samples.supervoxel_of[i - split.ground_count];
      if (supervoxel == kNoSupervoxel) {
        dynamic[i] = 0;
        belief[i] = 0.0F;
        continue;
      }
      const Verdict& verdict = verdicts_[supervoxel];
      dynamic[i] = verdict.dynamic;
      belief[i] = verdict.belief;
      if (verdict.dynamic != 0) {
        footprint_.add(points.x[i], points.y[i], points.z[i]);
        reach_.add(points.x[i], points.y[i], points.z[i]);
      }
    }
    if (!reach_.empty()) judge_ground(scan, record, split, dynamic, belief);
    footprint_.clear();
    reach_.clear();
  }

 private:
  struct Belief {
    float level = 0.0F;  // log-odds of the references summed up now; never negative
    float peak = 0.0F;   // the highest it was
    std::uint8_t contested = 0;  // whether some reference hit the place
  };
  struct Verdict {
    std::uint8_t dynamic;
    float belief;
  };
  struct View {
    std::uint64_t segment = kNoSegment;
    Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
    RangeImage image;
  };
  struct Record {
    std::uint64_t segment = kNoSegment;
    Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
    InstanceSamples samples;
    std::vector<Belief> beliefs;              // by supervoxel
    std::vector<std::uint8_t> seen_through;   // by instance
  };
  static constexpr std::uint64_t kNoSegment = ~std::uint64_t{0};

  // What one reference says of a set of samples; bits can be counted by adding.
  struct Sight {
    static constexpr std::uint8_t kUnknown = 0;
    static constexpr std::uint8_t kFree = 1;
    static constexpr std::uint8_t kHit = 2;
  };

  // Tests `count` samples (sensor frame of `T_world_sensor`, padded) against a reference.
  void look(PointsView padded, std::size_t count, const Eigen::Isometry3d& T_world_sensor,
            const View& reference) {
    using detail::Float8;
    const Eigen::Isometry3f T =
        (reference.T_world_sensor.inverse() * T_world_sensor).cast<float>();
    const auto& m = T.matrix();
    sights_.resize(count + detail::kLanes);
    const Float8 slope(static_cast<float>(100.0 * config_.margin_slope));
    const Float8 margin(static_cast<float>(100.0 * config_.margin));
    for (std::size_t i = 0; i < count; i += detail::kLanes) {
      const Float8 px = Float8::load(&padded.x[i]);
      const Float8 py = Float8::load(&padded.y[i]);
      const Float8 pz = Float8::load(&padded.z[i]);
      const Float8 x = (Float8(m(0, 0)) * px + Float8(m(0, 1)) * py) +
                       (Float8(m(0, 2)) * pz + Float8(m(0, 3)));
      const Float8 y = (Float8(m(1, 0)) * px + Float8(m(1, 1)) * py) +
                       (Float8(m(1, 2)) * pz + Float8(m(1, 3)));
      const Float8 z = (Float8(m(2, 0)) * px + Float8(m(2, 1)) * py) +
                       (Float8(m(2, 2)) * pz + Float8(m(2, 3)));
      const ImageLocation at = locate(grid_, x, y, z);
      std::int32_t cell[detail::kLanes];
      float range[detail::kLanes];
      float tolerance[detail::kLanes];
      at.cell.store(cell);
      const Float8 centimetres = at.range * Float8(100.0F);
      centimetres.store(range);
      (at.range * slope + margin).store(tolerance);
      const unsigned inside = at.inside.bits();
      for (std::size_t lane = 0; lane < detail::kLanes; ++lane) {
        const RangeImage::Cell seen = reference.image[static_cast<std::size_t>(cell[lane])];
        const float around = static_cast<float>(seen.around) - range[lane];
        const float nearest = static_cast<float>(seen.nearest) - range[lane];
        const bool free = around > tolerance[lane];
        const bool hit = !free && (std::abs(nearest) <= tolerance[lane] ||
                                   std::abs(around) <= tolerance[lane]);
        const unsigned sight = (free ? 1U : 0U) | (hit ? 2U : 0U);
        sights_[i + lane] = static_cast<std::uint8_t>(((inside >> lane) & 1U) != 0U ? sight : 0U);
      }
    }
  }

  // One reference for all samples of a scan: an update of every supervoxel's belief, and whether
  // it saw through whole instances.
  void refer(Record& record, const View& reference) {
    const InstanceSamples& samples = record.samples;
    look(samples.points, samples.size(), record.T_world_sensor, reference);
    for (std::size_t instance = 0; instance < samples.instance_count(); ++instance) {
      std::uint32_t instance_free = 0;
      std::uint32_t instance_hit = 0;
      const std::uint32_t first = samples.supervoxel_begin[instance];
      const std::uint32_t last = samples.supervoxel_begin[instance + 1];
      for (std::uint32_t s = first; s < last; ++s) {
        std::uint32_t free = 0;
        std::uint32_t hit = 0;
        const std::uint32_t end = samples.sample_begin[s + 1];
        for (std::uint32_t i = samples.sample_begin[s]; i < end; ++i) {
          free += sights_[i] & 1U;
          hit += sights_[i] >> 1U;
        }
        if (free + hit == 0) continue;
        instance_free += free;
        instance_hit += hit;
        update(record.beliefs[s], free, hit, end - samples.sample_begin[s]);
      }
      const auto seen = static_cast<float>(instance_free + instance_hit);
      const auto count = static_cast<float>(samples.sample_begin[last] - samples.sample_begin[first]);
      if (seen >= std::max(2.0F, kLeastView * count) &&
          static_cast<float>(instance_free) >= static_cast<float>(config_.see_share) * seen) {
        record.seen_through[instance] = 1;
      }
    }
  }

  // Eq. 15 with three-way increments as in Eq. 18, by the share of samples seen free; shares that
  // say little, or are of few samples, change nothing.
  void update(Belief& belief, std::uint32_t free, std::uint32_t hit, std::uint32_t samples) const {
    const auto n = static_cast<float>(samples);
    const auto f = static_cast<float>(free);
    const auto h = static_cast<float>(hit);
    const float share = f / (f + h);
    if (f >= kLeastFree * n && share >= kFreeShare) {
      belief.level += (share > kWhollyFree ? 2.0F : 1.0F) * increment_;
      belief.peak = std::max(belief.peak, belief.level);
    } else if (h >= std::max(std::min(2.0F, n), kLeastHit * n) && share <= kHitShare) {
      belief.contested = 1;
      belief.level = std::max(0.0F, belief.level + decrement_);
    }
  }

  void judge_instances(const Record& record) {
    const InstanceSamples& samples = record.samples;
    verdicts_.resize(samples.supervoxel_count());
    for (std::size_t instance = 0; instance < samples.instance_count(); ++instance) {
      const std::uint32_t first = samples.supervoxel_begin[instance];
      const std::uint32_t last = samples.supervoxel_begin[instance + 1];
      std::uint32_t moved = 0;    // samples in supervoxels that were free
      std::uint32_t decided = 0;  // samples in supervoxels of which anything is known
      float peak = 0.0F;
      for (std::uint32_t s = first; s < last; ++s) {
        const Belief& belief = record.beliefs[s];
        const bool dynamic =
            belief.peak >= (belief.contested != 0 ? contested_level_ : free_level_);
        const std::uint32_t count = samples.sample_begin[s + 1] - samples.sample_begin[s];
        if (dynamic) moved += count;
        if (dynamic || belief.contested != 0) decided += count;
        peak = std::max(peak, belief.peak);
        verdicts_[s] = {static_cast<std::uint8_t>(dynamic ? 1 : 0), as_probability(belief.peak)};
      }
      const bool whole =
          record.seen_through[instance] != 0 ||
          (moved > 0 && static_cast<float>(moved) >=
                            static_cast<float>(config_.remove_share) * static_cast<float>(decided));
      if (!whole) continue;
      const Verdict verdict = {1, as_probability(std::max(peak, free_level_))};
      std::fill(verdicts_.begin() + first, verdicts_.begin() + last, verdict);
    }
  }

  static float as_probability(float level) { return 1.0F / (1.0F + std::exp(-level)); }

  // Ground beside removed points: what stands within their footprint goes with them, and what two
  // references saw free was no ground.
  void judge_ground(std::uint64_t scan, const Record& record, const GroundSplit& split,
                    std::vector<std::uint8_t>& dynamic, std::vector<float>& belief) {
    sample_ground(split);
    const std::size_t count = ground_samples_.size();
    ground_free_.assign(count, 0);
    ground_hit_.assign(count, 0);
    for (const int lag : kLags) {
      const auto distance = static_cast<std::uint64_t>(lag);
      if (lag <= config_.memory && distance <= scan) count_ground(record, scan - distance);
      if (lag <= config_.horizon) count_ground(record, scan + distance);
    }
    const auto removed_belief = static_cast<float>(config_.tau_free);
    for (std::size_t i = 0; i < split.ground_count; ++i) {
      const float x = split.points.x[i];
      const float y = split.points.y[i];
      const float z = split.points.z[i];
      bool moved = config_.footprint > 0.0 && footprint_.lowest(x, y) < z + kClearance;
      const std::uint32_t voxel = ground_samples_.supervoxel_of[i];
      if (!moved && voxel != kNoSupervoxel) {
        const std::uint32_t sample = ground_samples_.sample_begin[voxel];
        const std::uint8_t free = ground_free_[sample];
        moved = free >= kGroundFree &&
                static_cast<float>(free) >= kGroundShare * static_cast<float>(ground_hit_[sample]);
      }
      if (moved) {
        dynamic[i] = 1;
        belief[i] = removed_belief;
      }
    }
  }

  void count_ground(const Record& record, std::uint64_t reference) {
    if (reference > newest_ || newest_ - reference >= views_.size()) return;
    const View& view = views_[reference % views_.size()];
    if (view.segment != record.segment) return;
    look(ground_samples_.points, ground_samples_.size(), record.T_world_sensor, view);
    for (std::size_t i = 0; i < ground_samples_.size(); ++i) {
      ground_free_[i] = static_cast<std::uint8_t>(ground_free_[i] + (sights_[i] & 1U));
      ground_hit_[i] = static_cast<std::uint8_t>(ground_hit_[i] + (sights_[i] >> 1U));
    }
  }

  void sample_ground(const GroundSplit& split) {
    const PointsView ground = split.ground();
    const float reach = static_cast<float>(config_.ground_reach);
    ground_instance_.resize(ground.size());
    for (std::size_t i = 0; i < ground.size(); ++i) {
      ground_instance_[i] =
          reach > 0.0F && std::isfinite(reach_.lowest(ground.x[i], ground.y[i])) ? 0 : kNoCluster;
    }
    ground_sampler_.sample(ground, ground_instance_, 1, ground_samples_);
  }

  static constexpr float kLeastView = 0.1F;    // share of an instance that a reference must see
  static constexpr float kLeastFree = 0.15F;   // share of a supervoxel that must be seen free
  static constexpr float kFreeShare = 0.6F;    // of what is seen, to speak for free space
  static constexpr float kWhollyFree = 0.9F;   // of what is seen, to count twice
  static constexpr float kLeastHit = 0.25F;    // share of a supervoxel that must be hit
  static constexpr float kHitShare = 0.3F;     // free share up to which a place counts as hit
  static constexpr float kClearance = 0.4F;    // m between ground and what stands on it
  static constexpr std::uint8_t kGroundFree = 2;
  static constexpr float kGroundShare = 0.3F;

  Config config_;
  InstanceSampler sampler_;
  InstanceSampler ground_sampler_;
  GroundFootprint footprint_;
  GroundFootprint reach_;
  float increment_;
  float decrement_;
  float free_level_;
  float contested_level_;
  RangeImageGrid grid_;
  std::uint64_t newest_ = 0;
  std::vector<View> views_;
  std::vector<Record> records_;
  RangeImage::Scratch image_scratch_;
  std::vector<std::uint8_t> sights_;
  std::vector<Verdict> verdicts_;
  InstanceSamples ground_samples_;
  std::vector<std::uint32_t> ground_instance_;
  std::vector<std::uint8_t> ground_free_;
  std::vector<std::uint8_t> ground_hit_;
};

}  // namespace dynains
