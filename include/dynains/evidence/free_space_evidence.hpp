// Free-space evidence: a point is dynamic if beams of other scans pass through its position. Free
// space identifies single dynamic points; instances define the points that are removed together.
// Goes beyond the paper, with beliefs in the form of Eq. 15-19.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/evidence/dynamic_occupancy_grid.hpp"
#include "dynains/evidence/free_space_config.hpp"
#include "dynains/evidence/ground_samples.hpp"
#include "dynains/evidence/instance_beliefs.hpp"
#include "dynains/evidence/instance_judge.hpp"
#include "dynains/evidence/instance_samples.hpp"
#include "dynains/evidence/instance_tracks.hpp"
#include "dynains/evidence/moved_ground.hpp"
#include "dynains/evidence/reference_scans.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/simd/short_numbers.hpp"
#include "dynains/threads/background.hpp"
#include "dynains/verdict.hpp"

namespace dynains {

/// Tests the samples of each scan against the range images of reference scans before and after it.
/// Sums the results as log-odds by supervoxel, and counts the supervoxels that moved along the
/// tracks of instances.
class FreeSpaceEvidence {
 public:
  using Config = FreeSpaceConfig;

  FreeSpaceEvidence() : FreeSpaceEvidence(Config()) {}

  /// Throws ConfigError.
  explicit FreeSpaceEvidence(const Config& config)
      : config_((config.validate(), config)),
        sampler_(config.supervoxel, config.evidence_range,
                 static_cast<std::uint32_t>(config.supervoxel_samples)),
        ground_sampler_(config),
        references_(config),
        updater_(config),
        linker_(config.track_cell, config.track_length, config.track_height, config.track_overlap),
        judge_(config),
        dynamic_grid_(config),
        moved_ground_(config),
        records_(static_cast<std::size_t>(config.lookahead_scans) + 2) {}

  const Config& config() const { return config_; }

  /// Number of later scans after which a verdict is final.
  std::size_t lookahead_scans() const { return static_cast<std::size_t>(config_.lookahead_scans); }

  /// Sets the sensors of a scan. Call it before the first scan, and after each new estimate of
  /// them. `all`: model of all together.
  void adapt(const SensorModel& all, Span<const SensorModel> sensors) {
    references_.adapt(sensors);
    moved_ground_.adapt(all);
  }

  /// Lets `other`, which outlives this, work for observe() and make_reference(). Results stay the
  /// same. Null: none.
  void share_work(Background* other) { other_ = other; }

  /// Adds a scan. `scan`: its number, consecutive from 0; 0 discards all earlier scans. `epoch`:
  /// only scans of one epoch, whose numbers follow each other, are compared. `T_world_sensor`:
  /// rigid, pose of the frame of `split`. `instance_of`: by non-ground point of `split`, instance
  /// below `instance_count`, or kNoCluster.
  void observe(std::uint64_t scan, std::uint64_t epoch, const Pose& T_world_sensor,
               const GroundSplit& split, Span<const std::uint32_t> instance_of,
               std::size_t instance_count) {
    if (scan == 0) forget_scans();
    if (scan == 0 || epoch_ != epoch) begin_epoch(scan, epoch, T_world_sensor);
    newest_ = scan;
    Record& record = record_of(scan);
    // The first scan of an epoch is the only reference of the second one, and shows what moves
    // fast. It is adjacent: what moves slowly still hides the places that it left. So its hits
    // serve only until a third scan comes: for the verdict without latency, or if none comes.
    if (scan == epoch_begin_ + 2) {
      detail::InstanceEvidence& second = record_of(scan - 1).evidence;
      updater_.begin(second.samples, second.beliefs);
    }
    record.T_world_sensor = T_world_sensor;
    record.epoch = epoch;
    record.since_begin = scan - epoch_begin_;
    const std::uint64_t phase = phase_of(record);
    run_both(
        phase != 0 ? other_ : nullptr,
        [&] {
          ground_sampler_.sample(split.ground(), record.ground);
          begin_evidence(split.non_ground(), instance_of, instance_count, record);
          link_to_previous(scan, record);
          test_against_earlier_references(scan, record);
        },
        // The older scans are at least two scans older, so the other thread does not use them.
        [&] {
          if (phase != 0) test_older_scans(phase);
        });
    keep_oldest_sums();
  }

  /// Judges the instances of scan number `scan` by the evidence of all observed scans: the newest
  /// one, or with `is_final`, without presumed instances, one at most lookahead_scans() before it.
  void judge(std::uint64_t scan, bool is_final) {
    Judged& judged = is_final ? final_ : provisional_;
    judged.scan = scan;
    Record& record = record_of(scan);
    sum_along_tracks(&Instance::past, scan);
    sum_along_tracks(&Instance::future, scan);
    // Everything is without evidence in a scan that no earlier one is compared with.
    const bool was_compared =
        record.since_begin >= static_cast<std::uint64_t>(detail::kReferenceLags.front());
    judge_.judge(record.evidence, updater_, !is_final && was_compared, judged.supervoxels);
    if (scan >= epoch_begin_) {  // the grid has the origin frame of the newest epoch
      dynamic_grid_.judge(scan, record.evidence.samples,
                          detail::composed(T_origin_world_, record.T_world_sensor), record.counted,
                          judged.supervoxels, is_final ? &record.evidence.tracked : nullptr);
    }
    if (!is_final && is_reference()) mark_movers(record.evidence);
  }

  /// Verdict on the scan of the last judge() with the same `is_final`, before the next observe().
  /// `split`: points of the scan, as in observe(). The spans are valid until the next call.
  EvidenceVerdict verdict(bool is_final, const GroundSplit& split) {
    const Judged& judged = is_final ? final_ : provisional_;
    const Record& record = record_of(judged.scan);
    const detail::InstanceSamples& samples = record.evidence.samples;
    groups_.assign(1, Verdict());
    groups_.insert(groups_.end(), judged.supervoxels.begin(), judged.supervoxels.end());
    groups_.resize(samples.instance_of.size() + 1);
    record.group_of_point.copy_to(group_of_);
    moved_ground_.add(split.non_ground(), group_of_, groups_);
    return {groups_, samples.instance_of, group_of_,
            moved_ground_.find(split.ground(), record.ground)};
  }

  /// Whether the newest scan is one of a reference for others.
  bool is_reference() const {
    return references_.takes(records_[newest_ % records_.size()].since_begin);
  }

  /// By non-ground point of the newest scan, after its first judge() if is_reference(): 0 if it
  /// does not move, 1 if it surely moves, 2 if it may move. Valid until the next judge().
  Span<const std::uint8_t> may_move() const { return may_move_; }

  /// Makes the range image of the newest scan, if is_reference(). Points that are certain to move
  /// only occlude in it. Call it after the first judge() of the scan. `split`: points of the
  /// scan.
  void make_reference(const GroundSplit& split) {
    const Record& record = record_of(newest_);
    references_.add(newest_, record.epoch, record.since_begin, record.T_world_sensor, split,
                    may_move_);
    if (phase_of(record) != 0 || delay_of(0) != 0) return;
    test_older_scans(0);
    keep_oldest_sums();
  }

  /// Free and hit samples of the newest scan, by references of earlier scans.
  detail::SurfaceCounts surfaces() const {
    const Record& record = records_[newest_ % records_.size()];
    detail::SurfaceCounts counts;
    for (std::size_t i = 0; i < record.ground.size(); ++i) {
      counts.ground_hit += record.ground.hit[i];
      counts.ground_free += record.ground.free[i];
    }
    for (const detail::InstanceBeliefs::Counts& instance : record.evidence.beliefs.counts) {
      counts.instances_decided += instance.decided;
      counts.instances_free += instance.moved;
    }
    return counts;
  }

  /// By instance of the newest scan: the linked instance of the scan before it, or kNoCluster.
  Span<const std::uint32_t> predecessors() const { return predecessors_; }

 private:
  using Verdict = EvidenceVerdict::Group;
  using Instance = detail::TrackedInstances::Instance;
  using Side = detail::TrackedInstances::Side;
  using Seen = detail::TrackedInstances::Seen;
  struct Record {
    std::uint64_t epoch = detail::ReferenceScan::kNoEpoch;
    Pose T_world_sensor = Pose::Identity();
    std::uint64_t since_begin = 0;  // scans since the first scan of the epoch
    detail::InstanceEvidence evidence;
    detail::ShortNumbers group_of_point;  // by non-ground point, as in InstanceSamples
    std::vector<detail::DynamicOccupancyGrid::Count> counted;  // by supervoxel
    detail::GroundSamples ground;
  };
  struct Judged {
    std::uint64_t scan = 0;
    std::vector<Verdict> supervoxels;
  };

  void forget_scans() {
    references_.forget();
    for (Record& record : records_) record.epoch = detail::ReferenceScan::kNoEpoch;
  }

  void begin_epoch(std::uint64_t scan, std::uint64_t epoch, const Pose& T_world_sensor) {
    T_origin_world_ = detail::inverted(T_world_sensor);
    epoch_ = epoch;
    epoch_begin_ = scan;
    dynamic_grid_.clear();
  }

  Record& record_of(std::uint64_t scan) { return records_[scan % records_.size()]; }

  void begin_evidence(PointsView points, Span<const std::uint32_t> instance_of,
                      std::size_t instance_count, Record& record) {
    detail::InstanceEvidence& evidence = record.evidence;
    evidence.samples.group_of_point.swap(newest_group_of_point_);
    sampler_.sample(points, instance_of, instance_count, evidence.samples);
    sampler_.find_reach(evidence.samples);
    newest_group_of_point_.swap(evidence.samples.group_of_point);
    record.group_of_point.assign(newest_group_of_point_);
    updater_.begin(evidence.samples, evidence.beliefs);
    record.counted.assign(evidence.samples.supervoxel_count(),
                          detail::DynamicOccupancyGrid::Count::kNone);
    predecessors_.assign(instance_count, kNoCluster);
  }

  void link_to_previous(std::uint64_t scan, Record& record) {
    detail::InstanceEvidence& evidence = record.evidence;
    linker_.measure(evidence.samples, detail::composed(T_origin_world_, record.T_world_sensor),
                    evidence.tracked);
    if (scan > epoch_begin_) linker_.link(record_of(scan - 1).evidence.tracked, evidence.tracked);
    for (std::size_t i = 0; i < predecessors_.size(); ++i) {
      predecessors_[i] = evidence.tracked.instances[i].past.instance;
    }
  }

  void test_against_earlier_references(std::uint64_t scan, Record& record) {
    const auto lookback = static_cast<std::uint64_t>(config_.lookback_scans);
    for (std::uint64_t age = 1; age <= record.since_begin && age <= lookback; ++age) {
      const bool is_compared =
          references_.span().compares(record.since_begin, static_cast<int>(age));
      if (!is_compared && record.since_begin != 1) continue;
      const detail::ReferenceScan* const reference = references_.find(scan - age, record.epoch);
      if (reference != nullptr) test(scan, record, *reference, newest_test_);
    }
  }

  // Scans since the latest reference.
  std::uint64_t phase_of(const Record& record) const {
    return record.since_begin % static_cast<std::uint64_t>(references_.span().step);
  }

  // Tests all samples of scan number `scan` against one reference. `memory`: of the thread.
  void test(std::uint64_t scan, Record& record, const detail::ReferenceScan& reference,
            detail::Visibility& memory) const {
    record.ground.add(references_.test(record.ground.points, record.ground.size(), scan,
                                       record.T_world_sensor, reference, memory));
    detail::InstanceEvidence& evidence = record.evidence;
    const detail::Visibility& visibility =
        references_.test(evidence.samples.points, evidence.samples.size(), scan,
                         record.T_world_sensor, reference, memory, evidence.samples.reach.data());
    const Pose T_sensor_reference =
        detail::composed(detail::inverted(record.T_world_sensor), reference.T_world_level);
    updater_.update(evidence.samples, visibility, T_sensor_reference.translation().cast<float>(),
                    evidence.beliefs);
  }

  // Scans are numbered by phase: 0 for references, then 1, 2, ... up to the next reference. Tests
  // of older scans against a new image are distributed over the pushes that follow: scans of a
  // phase are tested this many pushes after the image was made. For phase 0 it is one push, because
  // the push of a reference already makes the image.
  std::uint64_t delay_of(std::uint64_t phase) const {
    return phase == 0 && references_.span().step > 1 ? 1 : phase;
  }

  // Tests older scans of the phases with this delay against the newest image.
  void test_older_scans(std::uint64_t delay) {
    const detail::ReferenceScan& reference = references_.newest();
    if (reference.scan + phase_of(record_of(newest_)) != newest_) return;
    const int most = config_.lookahead_scans - static_cast<int>(delay);
    for (int age = 1; age <= most && static_cast<std::uint64_t>(age) <= reference.scan; ++age) {
      const std::uint64_t scan = reference.scan - static_cast<std::uint64_t>(age);
      Record& older = record_of(scan);
      if (older.epoch != reference.epoch || delay_of(phase_of(older)) != delay ||
          !detail::is_compared(age, references_.span().step, most)) {
        continue;
      }
      test(scan, older, reference, older_test_);
    }
  }

  // The past sums of the oldest scan without a final verdict serve for all later scans.
  void keep_oldest_sums() {
    if (newest_ < lookahead_scans()) return;
    sum_along_tracks(&Instance::past, newest_ - lookahead_scans());
  }

  // Sums the samples of each instance of a scan along its track, on one side.
  void sum_along_tracks(Side Instance::*side, std::uint64_t scan) {
    std::vector<Instance>& instances = record_of(scan).evidence.tracked.instances;
    for (std::uint32_t i = 0; i < instances.size(); ++i) {
      (instances[i].*side).seen = seen_along_track(side, scan, i);
    }
  }

  Seen seen_along_track(Side Instance::*side, std::uint64_t scan, std::uint32_t instance) {
    const detail::InstanceEvidence& evidence = record_of(scan).evidence;
    const std::uint32_t linked = (evidence.tracked.instances[instance].*side).instance;
    Seen beside;
    if (linked != kNoCluster) {
      const bool is_known = side == &Instance::past && scan + lookahead_scans() <= newest_;
      const std::uint64_t adjacent = side == &Instance::past ? scan - 1 : scan + 1;
      beside = is_known ? record_of(adjacent).evidence.tracked.instances[linked].past.seen
                        : seen_along_track(side, adjacent, linked);
    }
    return detail::sum_along_track(evidence.beliefs.counts[instance], beside);
  }

  // Whether the instance of a supervoxel is small enough to move, and is not static by the evidence
  // on this scan. Slow vehicles around the sensor would bias its pose.
  bool may_move(const detail::InstanceEvidence& evidence, std::uint32_t supervoxel) const {
    const std::uint32_t instance = evidence.samples.instance_of[supervoxel];
    return evidence.tracked.shapes[instance].carried &&
           !evidence.beliefs.counts[instance].stands_still();
  }

  // Marks the points of the newest scan, see may_move().
  void mark_movers(const detail::InstanceEvidence& evidence) {
    const detail::InstanceSamples& samples = evidence.samples;
    mark_of_group_.assign(samples.instance_of.size() + 1, 0);
    for (std::uint32_t s = 0; s < samples.supervoxel_count(); ++s) {
      const bool moves = judge_.surely_moves(evidence, s, provisional_.supervoxels[s].cause);
      mark_of_group_[s + 1] = moves ? 1 : may_move(evidence, s) ? 2 : 0;
    }
    detail::resize_with_margin(may_move_, newest_group_of_point_.size());
    // Local copies: the compiler must assume that a store of a byte changes members.
    const std::uint8_t* const mark_of_group = mark_of_group_.data();
    const std::uint32_t* const group_of_point = newest_group_of_point_.data();
    std::uint8_t* const marks = may_move_.data();
    for (std::size_t i = 0; i < may_move_.size(); ++i) marks[i] = mark_of_group[group_of_point[i]];
  }

  Config config_;
  detail::InstanceSampler sampler_;
  detail::GroundSampler ground_sampler_;
  detail::ReferenceScans references_;
  detail::InstanceBeliefUpdater updater_;
  detail::Visibility newest_test_, older_test_;  // of each thread
  Background* other_ = nullptr;
  detail::InstanceLinker linker_;
  detail::InstanceJudge judge_;
  detail::DynamicOccupancyGrid dynamic_grid_;
  detail::MovedGround moved_ground_;
  // The origin frame is the sensor frame of the first scan of the epoch. It is the frame of the
  // cells of tracks and of the dynamic occupancy grid, which thus do not depend on the world frame.
  Pose T_origin_world_ = Pose::Identity();
  std::uint64_t epoch_ = 0;        // of the newest scan
  std::uint64_t epoch_begin_ = 0;  // its first scan
  std::uint64_t newest_ = 0;
  std::vector<Record> records_;  // ring buffer, by scan number
  Judged provisional_, final_;
  std::vector<std::uint32_t> newest_group_of_point_, group_of_;
  std::vector<Verdict> groups_;
  std::vector<std::uint8_t> mark_of_group_;
  std::vector<std::uint8_t> may_move_;  // by non-ground point
  std::vector<std::uint32_t> predecessors_;
};

}  // namespace dynains
