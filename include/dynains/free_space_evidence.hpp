// Free-space evidence: a beam of another scan that passed through the place of a point shows that
// the point was part of something that moved. Free space says where something moved; instances say
// what to remove whole. Goes beyond the paper, in the form of its belief (Eq. 15-19).
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "dynains/belief_updater.hpp"
#include "dynains/cause.hpp"
#include "dynains/evidence/dynamic_occupancy_grid.hpp"
#include "dynains/evidence/instance_beliefs.hpp"
#include "dynains/evidence/instance_samples.hpp"
#include "dynains/evidence/instance_tracks.hpp"
#include "dynains/evidence/moved_ground.hpp"
#include "dynains/evidence/reference_lags.hpp"
#include "dynains/evidence/reference_scans.hpp"
#include "dynains/evidence/supervoxel_groups.hpp"
#include "dynains/points.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/simd/capacity.hpp"
#include "dynains/stage/evidence_verdict.hpp"
#include "dynains/stage/free_space_config.hpp"
#include "dynains/stage/ground_split.hpp"

namespace dynains {

/// Tests samples of each scan against references before and after it, accumulates what they show as
/// belief per supervoxel and instance, each side apart, and carries beliefs along instances that
/// overlap from scan to scan.
class FreeSpaceEvidence {
 public:
  using Config = FreeSpaceConfig;

  FreeSpaceEvidence() : FreeSpaceEvidence(Config()) {}

  /// Throws ConfigError.
  explicit FreeSpaceEvidence(const Config& config)
      : config_((config.validate(), config)),
        sampler_(config.supervoxel, config.evidence_range,
                 static_cast<std::uint32_t>(config.supervoxel_samples)),
        references_(config),
        updater_(config),
        track_level_(static_cast<float>(log_odds(config.tau_track))),
        linker_(config.track_cell, config.track_length, config.track_height, config.track_overlap),
        track_belief_(updater_.increment()),
        dynamic_grid_(config),
        moved_ground_(config),
        records_(static_cast<std::size_t>(config.lookahead_scans) + 2) {
    const int step = config.reference_step;
    for (int phase = 0; phase < step; ++phase) {
      const auto turn = static_cast<int>(turn_of(static_cast<std::uint64_t>(phase)));
      before_.push_back(reference_lags(config.lookback_scans, phase, step));
      after_.push_back(reference_lags(config.lookahead_scans - turn, step - phase, step));
    }
  }

  const Config& config() const { return config_; }

  /// Scans after which a verdict is final.
  std::size_t lookahead_scans() const { return static_cast<std::size_t>(config_.lookahead_scans); }

  /// Takes over what depends on the sensor; to be called before the first scan, and again once more
  /// is known of it.
  void adapt(const SensorModel& sensor) {
    references_.adapt(sensor);
    moved_ground_.adapt(sensor);
  }

  /// Lets judge() be asked about scans up to that many behind the newest, if these are more than
  /// lookahead_scans(): what happened later than that says nothing about them. To be called before
  /// the first scan.
  void keep(std::size_t scans) { records_.resize(std::max(records_.size(), scans + 2)); }

  /// Gets the memory of images for that many scans of the sensor that adapt() was told, and of what
  /// else is kept of scans if one was observed already; or for as many as are ever kept. What was
  /// observed is lost: to be called before scan 0, or before it comes again.
  void reserve(std::size_t scans) {
    references_.reserve(scans);
    const auto largest = std::max_element(
        records_.begin(), records_.end(),
        [](const Record& a, const Record& b) { return a.samples.size() < b.samples.size(); });
    // A copy has room for what it holds and no more, and scans of one sensor differ a little.
    Record roomy = *largest;
    std::vector<std::uint32_t>& by_point = roomy.samples.met_of;
    by_point.resize(by_point.size() + by_point.size() / 8);
    for (std::size_t i = 0; i < std::min(scans, records_.size()); ++i) records_[i] = roomy;
  }

  /// Takes scan number `scan` in: scans come in order, from 0. `instance_of` holds the instance of
  /// each non-ground point of `split`, below `instance_count` or kNoCluster. Only scans of the
  /// same `epoch` are compared.
  void observe(std::uint64_t scan, std::uint64_t epoch, const Eigen::Isometry3d& T_world_sensor,
               const GroundSplit& split, Span<const std::uint32_t> instance_of,
               std::size_t instance_count) {
    if (scan == 0) forget();
    if (scan == 0 || record_of(scan - 1).epoch != epoch) {
      T_origin_world_ = T_world_sensor.inverse();
      epoch_begin_ = scan;
      dynamic_grid_.forget();
    }
    newest_ = scan;
    Record& record = record_of(scan);
    record.epoch = epoch;
    record.T_world_sensor = T_world_sensor;
    record.at = references_.advance(scan - epoch_begin_);
    moved_ground_.bound(split.ground(), record.ground_boxes);
    sampler_.sample(split.non_ground(), instance_of, instance_count, record.samples);
    updater_.begin(record.samples, record.beliefs);
    record.counted.assign(record.samples.supervoxel_count(), DynamicOccupancyGrid::Count::kNone);
    predecessors_.assign(instance_count, kNoCluster);
    if (config_.use_tracks) track(scan, record);

    for (const int lag : before_[record.at.phase]) {
      const ReferenceScan* const reference = reference_of(record, scan, -lag);
      if (reference != nullptr) refer(record, *reference, -lag);
    }
    updater_.begin_other_side(record.samples, record.beliefs);
    weigh(record);
    if (record.at.phase != 0) refer_turn(record.at.phase);
    if (config_.use_tracks) run_beliefs(scan);
  }

  /// Verdict on a scan that is at most `lookahead_scans()` old, or what keep() was told, as the
  /// evidence stands now. Nothing is presumed in a final verdict. `split`: that of the scan. The
  /// spans hold until the next call. The first verdict on the scan observed last makes it a
  /// reference for others, if it is one; without, it is none.
  EvidenceVerdict judge(std::uint64_t scan, bool is_final, const GroundSplit& split) {
    Record& record = record_of(scan);
    judge_instances(scan, is_final, record);
    const InstanceSamples& samples = record.samples;
    // Cells lie in the frame of the newest epoch.
    if (scan >= epoch_begin_) {
      dynamic_grid_.judge(scan, samples, T_origin_world_ * record.T_world_sensor, record.counted,
                          verdicts_);
    }
    if (scan == newest_ && record.at.phase == 0 && references_.awaits_image()) {
      become_reference(record, split);
    }
    groups_.assign(1, {Cause::kNotJudged, 0.0F});
    groups_.resize(samples.met.size());
    for (std::size_t i = 1; i < samples.met.size(); ++i) groups_[i] = verdicts_[samples.met[i]];
    moved_ground_.add(split.non_ground(), samples.met_of, groups_);
    const auto ground = moved_ground_.find(
        split.ground(), record.ground_boxes,
        [&](const PointBuffer& points, std::size_t count, auto&& visit) {
          const auto look = [&](int lag) {
            const ReferenceScan* const reference = reference_of(record, scan, lag);
            if (reference == nullptr) return;
            visit(references_.look(points, count, record.T_world_sensor, *reference));
          };
          for (const int lag : before_[record.at.phase]) look(-lag);
          for (const int lag : after_[record.at.phase]) look(lag);
        });
    return {groups_, samples.met_of, ground};
  }

  /// What the newest reference, one of the last `reference_step` scans, saw of the first `count`
  /// points (m; padded for wide loads).
  const detail::Visibility& see(const PointBuffer& points, std::size_t count,
                                const Eigen::Isometry3d& T_world_points) {
    return references_.look(points, count, T_world_points, references_.newest());
  }

  /// For each instance of the scan observed last, its number in the scan before, or kNoCluster.
  Span<const std::uint32_t> predecessors() const { return predecessors_; }

 private:
  using Verdict = EvidenceVerdict::Group;
  struct Record {
    std::uint64_t epoch = ReferenceScan::kNoEpoch;
    Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
    ReferencePhase at;
    InstanceSamples samples;
    InstanceBeliefs beliefs;
    TrackedInstances tracked;
    std::vector<DynamicOccupancyGrid::Count> counted;  // by supervoxel
    std::vector<GroundBox> ground_boxes;               // by 64 points of the ground
  };

  // Numbers of scans begin again: what is kept is of others.
  void forget() {
    references_.forget();
    for (Record& record : records_) record.epoch = ReferenceScan::kNoEpoch;
  }

  const ReferenceScan* reference_of(const Record& record, std::uint64_t scan, int lag) const {
    return references_.find(scan, record.epoch, record.at, lag);
  }

  Record& record_of(std::uint64_t scan) { return records_[scan % records_.size()]; }

  // One reference for all samples of a scan. `lag`: scans from the samples to the reference.
  void refer(Record& record, const ReferenceScan& reference, int lag) {
    const InstanceSamples& samples = record.samples;
    const detail::Visibility& visibility =
        references_.look(samples.points, samples.size(), record.T_world_sensor, reference);
    updater_.update(samples, visibility, record.beliefs, [&](std::size_t instance) {
      if (!config_.use_tracks) return;
      TrackedInstances::Instance& tracked = record.tracked.instances[instance];
      (lag < 0 ? tracked.hit_back : tracked.hit_ahead) = static_cast<std::int16_t>(std::abs(lag));
    });
  }

  // Scans of one phase are held against a new image after the other, for each new scan to bring as
  // much work; those of the image's own phase have to wait for the next scan, as making it was work
  // enough.
  std::uint64_t turn_of(std::uint64_t phase) const {
    return phase == 0 && config_.reference_step > 1 ? 1 : phase;
  }

  // Makes the image of the newest scan, and holds it against older ones whose turn it is. What
  // moves protects nothing: what it hits again may be another, and beside it beams may pass.
  void become_reference(const Record& record, const GroundSplit& split) {
    moving_.clear();
    if (config_.ignore_dynamic_returns) {
      const InstanceSamples& samples = record.samples;
      moving_groups_.assign(samples.met.size(), 0);
      for (std::size_t i = 1; i < samples.met.size(); ++i) {
        moving_groups_[i] = surely_moves(record, samples.met[i]) ? 1 : 0;
      }
      detail::ensure_capacity(moving_, samples.met_of.size());
      moving_.resize(samples.met_of.size());
      for (std::size_t i = 0; i < moving_.size(); ++i) {
        moving_[i] = moving_groups_[samples.met_of[i]];
      }
    }
    references_.make_image(newest_, record.epoch, record.T_world_sensor, split, moving_);
    if (turn_of(0) != 0) return;
    refer_turn(0);
    if (config_.use_tracks) run_beliefs(newest_);
  }

  // Whether a supervoxel goes, and not only because some of its instance was seen free: that may be
  // foliage, or stand beside what moves.
  bool surely_moves(const Record& record, std::uint32_t supervoxel) const {
    const Cause cause = verdicts_[supervoxel].cause;
    if (cause == Cause::kFreeSpace || cause == Cause::kDynamicOccupancy) return true;
    if (!config_.use_tracks || !is_dynamic(cause) || cause == Cause::kPresumed) return false;
    const std::uint32_t instance = record.samples.instance_of[supervoxel];
    const InstanceBeliefs::Share& share = record.beliefs.shares[instance];
    return 2 * share.moved >= share.decided &&
           track_belief(record.tracked.instances[instance]) >= track_level_;
  }

  // Holds the newest image against older scans, those of the phases whose turn it is.
  void refer_turn(std::uint64_t turn) {
    if (references_.awaits_image()) return;
    for (std::uint64_t phase = 0; phase < before_.size(); ++phase) {
      if (turn_of(phase) == turn) refer_older(phase, references_.newest());
    }
  }
  void refer_older(std::uint64_t phase, const ReferenceScan& image) {
    for (const int lag : after_[phase]) {
      const auto back = static_cast<std::uint64_t>(lag);
      if (back > image.scan) break;
      Record& older = record_of(image.scan - back);
      if (older.epoch != image.epoch) continue;
      refer(older, image, lag);
      weigh(older);
    }
  }

  // What its own evidence says of each instance.
  void weigh(Record& record) const {
    if (!config_.use_tracks) return;
    std::vector<std::uint8_t>& changed = record.beliefs.changed;
    for (std::size_t instance = 0; instance < changed.size(); ++instance) {
      if (changed[instance] == 0) continue;
      changed[instance] = 0;
      record.tracked.instances[instance].own = own_belief(record, instance);
    }
  }

  float own_belief(const Record& record, std::size_t instance) const {
    const InstanceBeliefs::Share& share = record.beliefs.shares[instance];
    const float unit = updater_.increment();
    if (updater_.removes_whole(record.samples, record.beliefs, instance)) {
      return (2 * share.moved >= share.decided && share.moved > 0 ? 2.0F : 1.0F) * unit;
    }
    const auto moved = static_cast<float>(share.moved);
    const auto decided = static_cast<float>(share.decided);
    const bool known =
        decided >= InstanceBeliefUpdater::kLeastKnown * static_cast<float>(share.total) &&
        decided > 0.0F;
    return known && moved < kStillShare * decided ? -static_cast<float>(config_.still_weight) * unit
                                                  : 0.0F;
  }

  // Finds the instances of the newest scan again in the scan before.
  void track(std::uint64_t scan, Record& record) {
    linker_.measure(record.samples, T_origin_world_ * record.T_world_sensor, record.tracked);
    if (scan > epoch_begin_) {
      linker_.link(record_of(scan - 1).tracked, record.tracked);
    }
    for (std::size_t i = 0; i < predecessors_.size(); ++i) {
      predecessors_[i] = record.tracked.instances[i].previous;
    }
  }

  // Beliefs along tracks, with what is known now of every scan that is still open: a scan just
  // behind the newest may meanwhile have been seen through.
  void run_beliefs(std::uint64_t newest) {
    const std::uint64_t open = std::min<std::uint64_t>(newest, lookahead_scans());
    for (std::uint64_t scan = newest - open; scan <= newest; ++scan) {
      Record& record = record_of(scan);
      const bool linked = scan > 0 && record_of(scan - 1).epoch == record.epoch;
      track_belief_.run_forward(linked ? &record_of(scan - 1).tracked : nullptr, record.tracked);
    }
    for (std::uint64_t scan = newest + 1; scan-- > newest - open;) {
      Record& record = record_of(scan);
      const bool linked = scan < newest && record_of(scan + 1).epoch == record.epoch;
      track_belief_.run_backward(linked ? &record_of(scan + 1).tracked : nullptr, record.tracked);
    }
  }

  // Belief that an instance moved from its whole track, its own evidence counted once.
  float track_belief(const TrackedInstances::Instance& instance) const {
    const float before = std::max(0.0F, instance.forward - instance.own);
    const float after = std::max(0.0F, instance.backward - instance.own);
    return instance.own + before + after;
  }

  void judge_instances(std::uint64_t scan, bool is_final, const Record& record) {
    const InstanceSamples& samples = record.samples;
    verdicts_.resize(samples.supervoxel_count());
    for (std::size_t instance = 0; instance < samples.instance_count(); ++instance) {
      const std::uint32_t first = samples.supervoxel_begin[instance];
      const std::uint32_t last = samples.supervoxel_begin[instance + 1];
      float level = 0.0F;
      free_.clear();
      for (std::uint32_t s = first; s < last; ++s) {
        const InstanceBeliefs::Belief& belief = record.beliefs.supervoxels[s];
        level = std::max(level, belief.peak);
        verdicts_[s] = {cause_to_stay(belief), as_probability(belief.peak)};
        if (updater_.is_free(belief)) free_.push_back(s);
      }
      const Cause whole = cause_of_whole(scan, is_final, record, instance, level);
      if (is_dynamic(whole)) {
        const Verdict verdict = {whole, as_probability(std::max(level, updater_.free_level()))};
        std::fill(verdicts_.begin() + first, verdicts_.begin() + last, verdict);
        for (const std::uint32_t s : free_) verdicts_[s].cause = Cause::kFreeSpace;
        add_hull(record, instance);
        continue;
      }
      // Something that moves beside something that stays: a few samples may be chance.
      supervoxel_groups_.keep_large(samples, kLeastGroup, free_);
      for (const std::uint32_t s : free_) verdicts_[s].cause = Cause::kFreeSpace;
    }
  }

  // Of a supervoxel that stays.
  static Cause cause_to_stay(const InstanceBeliefs::Belief& belief) {
    if (belief.peak > 0.0F) return Cause::kTooLittleFree;
    return belief.contested != 0 ? Cause::kOccupied : Cause::kNoEvidence;
  }

  // Why an instance is removed as a whole, or kNoEvidence if it is not; raises `level` to the
  // belief along its track.
  Cause cause_of_whole(std::uint64_t scan, bool is_final, const Record& record,
                       std::size_t instance, float& level) const {
    if (updater_.removes_whole(record.samples, record.beliefs, instance)) {
      return Cause::kWithInstance;
    }
    if (!config_.use_tracks || !record.tracked.shapes[instance].carried) {
      return Cause::kNoEvidence;
    }
    const float along = track_belief(record.tracked.instances[instance]);
    level = std::max(level, along);
    if (along >= track_level_) return Cause::kAlongTrack;
    return !is_final && presumed(scan, record, instance) ? Cause::kPresumed : Cause::kNoEvidence;
  }

  // The ground below a compact instance.
  void add_hull(const Record& record, std::size_t instance) {
    constexpr float kLeastHeight = 0.3F;  // m
    if (!config_.use_tracks) return;
    const TrackedInstances::Shape& shape = record.tracked.shapes[instance];
    if (!shape.carried || shape.height < kLeastHeight) return;
    const InstanceSamples& samples = record.samples;
    const std::uint32_t begin = samples.sample_begin[samples.supervoxel_begin[instance]];
    const std::uint32_t end = samples.sample_begin[samples.supervoxel_begin[instance + 1]];
    moved_ground_.add_hull(PointsView(samples.points).subview(begin, end - begin));
  }

  // Zero latency: a compact instance in a place that no earlier scan has seen may be the lead
  // vehicle as well as something static that came into view; the next scans will tell.
  bool presumed(std::uint64_t scan, const Record& record, std::size_t instance) const {
    constexpr std::uint32_t kLeastSamples = 5;
    constexpr float kLargest = 15.0F, kHighest = 3.5F, kUnknown = 0.1F;
    // Where comparison has just begun, no place has been seen.
    if (!config_.presume_dynamic || scan < epoch_begin_ + 2) return false;
    const InstanceBeliefs::Share& share = record.beliefs.shares[instance];
    const TrackedInstances::Shape& shape = record.tracked.shapes[instance];
    return share.total >= kLeastSamples && shape.length <= kLargest && shape.height <= kHighest &&
           static_cast<float>(share.decided) <= kUnknown * static_cast<float>(share.total);
  }

  // Most supervoxels were never seen free: they need no exponential.
  static float as_probability(float level) {
    return level == 0.0F ? 0.5F : 1.0F / (1.0F + std::exp(-level));
  }

  static constexpr float kStillShare = 0.02F;    // moved share of the known below which it stands
  static constexpr std::size_t kLeastGroup = 4;  // samples that go without the rest

  Config config_;
  InstanceSampler sampler_;
  ReferenceScans references_;
  InstanceBeliefUpdater updater_;
  float track_level_;
  InstanceLinker linker_;
  TrackBelief track_belief_;
  DynamicOccupancyGrid dynamic_grid_;
  MovedGround moved_ground_;
  SupervoxelGroups supervoxel_groups_;
  // The first sensor of the epoch, in whose frame cells of tracks and passages lie wherever the
  // world begins.
  Eigen::Isometry3d T_origin_world_ = Eigen::Isometry3d::Identity();
  std::uint64_t epoch_begin_ = 0;  // first scan of the epoch of the newest
  std::uint64_t newest_ = 0;
  // By phase: scans to the references before and after.
  std::vector<std::vector<int>> before_, after_;
  std::vector<Record> records_;
  std::vector<Verdict> verdicts_;            // by supervoxel
  std::vector<Verdict> groups_;              // by position in InstanceSamples::met
  std::vector<std::uint8_t> moving_groups_;  // by position in InstanceSamples::met
  std::vector<std::uint8_t> moving_;         // by point above the ground
  std::vector<std::uint32_t> free_;
  std::vector<std::uint32_t> predecessors_;
};

}  // namespace dynains
