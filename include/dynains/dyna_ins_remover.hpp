// DynaInsRemover: scans and poses in, moving instances out, static map kept.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "dynains/belief_updater.hpp"
#include "dynains/config.hpp"
#include "dynains/curved_voxel_clusterer.hpp"
#include "dynains/errors.hpp"
#include "dynains/free_space_evidence.hpp"
#include "dynains/ground_segmenter.hpp"
#include "dynains/map/map_revision.hpp"
#include "dynains/occupancy_descriptor.hpp"
#include "dynains/pipeline/ingest.hpp"
#include "dynains/pipeline/instance_ids.hpp"
#include "dynains/pipeline/reentrancy_guard.hpp"
#include "dynains/pipeline/remover_config.hpp"
#include "dynains/pipeline/scan_slot.hpp"
#include "dynains/pipeline/synthetic_scan.hpp"
#include "dynains/pipeline/write_by_evidence.hpp"
#include "dynains/pipeline/write_by_windows.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/level_frame.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/stage/cluster_set.hpp"
#include "dynains/stage/contracts.hpp"
#include "dynains/stage/polar_points.hpp"
#include "dynains/static_map_accumulator.hpp"
#include "dynains/verdict.hpp"

namespace dynains {

/// The stages of the pipeline. To swap one, derive from this and re-alias its name.
struct DefaultStages {
  using Ground = GroundSegmenter;
  using Clusterer = CurvedVoxelClusterer;
  using Descriptor = OccupancyDescriptor;
  using Belief = BeliefUpdater;
  using Evidence = FreeSpaceEvidence;
  using Map = StaticMapAccumulator;
};

/// Removes moving instances from a stream of scans, one scan at a time.
///
/// Owns every buffer; once warm, a frame allocates nothing except when the map grows. Objects are
/// independent of each other. One object serves one thread at a time: `push`, `flush`, `reset`,
/// `reserve` and `reserve_like` throw UsageError while another of these calls is at work.
/// Everything that is read from it, the map and the spans of a verdict, is read between two calls:
/// by the thread that makes them, or by others under a lock that these calls are made under as
/// well. Can be moved; what was moved from can only be assigned to or destroyed, and throws
/// UsageError if it is asked to push or flush.
template <class Stages = DefaultStages>
class BasicDynaInsRemover {
 public:
  using Ground = typename Stages::Ground;
  using Clusterer = typename Stages::Clusterer;
  using Descriptor = typename Stages::Descriptor;
  using Belief = typename Stages::Belief;
  using Evidence = typename detail::EvidenceOf<Stages, FreeSpaceEvidence>::type;
  using Map = typename Stages::Map;

  /// Whether this map can be revised, see MapRevision.
  static constexpr bool kRevisable = detail::IsRevisable<Map, Evidence>::value;

  static_assert(detail::IsConfigurable<Ground>::value && detail::IsGround<Ground>::value,
                "Stages::Ground needs Config and segment(PointsView, numbers, "
                "GroundSplit&)");
  static_assert(detail::IsConfigurable<Clusterer>::value && detail::IsClusterer<Clusterer>::value,
                "Stages::Clusterer needs Config, cluster(PolarView) and cluster_count()");
  static_assert(
      detail::IsConfigurable<Descriptor>::value && detail::IsDescriptor<Descriptor>::value,
      "Stages::Descriptor needs Config, describe(ClusterView), describe_rest(), heights(k), "
      "cluster_heights() and proposes_dynamic()");
  static_assert(detail::IsConfigurable<Belief>::value && detail::IsBelief<Belief>::value,
                "Stages::Belief needs Config, reset(), update(heights, heights), posterior() and "
                "is_dynamic()");
  static_assert(detail::IsConfigurable<Evidence>::value && detail::IsEvidence<Evidence>::value,
                "Stages::Evidence needs Config, adapt(SensorModel), observe(...), judge(...), "
                "predecessors() and horizon()");
  static_assert(detail::IsConfigurable<Map>::value && detail::IsMap<Map>::value,
                "Stages::Map needs Config, insert(PointsView, flags, T_world_sensor) and clear()");

  /// All parameters, see RemoverConfig and the Config of each stage.
  using Config = PipelineConfig<Stages>;

  BasicDynaInsRemover() : BasicDynaInsRemover(Config()) {}

  /// Throws ConfigError.
  explicit BasicDynaInsRemover(const Config& config)
      : config_((config.validate(), config)),
        ground_(config.ground),
        clusterer_(config.clusterer),
        descriptor_(config.descriptor),
        belief_(config.belief),
        evidence_(config.evidence),
        map_(config.map),
        revision_(config.revision),
        frame_(config),
        ring_(std::max({static_cast<std::size_t>(config.window), latency() + 1, kFewestSlots})) {
    if (config_.use_free_space) detail::keep_in_stage(evidence_, latency());
  }

  const Config& config() const { return config_; }
  const Map& map() const { return map_; }

  /// Scans between a push and the final verdict on it.
  std::size_t latency() const {
    const std::size_t by_votes =
        config_.votes == 0 ? 0 : static_cast<std::size_t>(config_.window) - 1;
    return config_.use_free_space ? std::max(by_votes, evidence_.horizon()) : by_votes;
  }

  /// What the first scan told about the sensor; not known() before, or if all that depends on it
  /// was given.
  const SensorModel& sensor() const { return frame_.sensor(); }

  /// Gets the memory that scans like `example` need and touches it, so that the first scans do not
  /// wait for the system to give it: 27 to 38 bytes per point for each scan that is open at once,
  /// window or latency() + 1 of them, and what the stages keep, for which the example is taken in
  /// some times and forgotten. `scans`: how many will come, if that is known. Other scans are
  /// welcome all the same, and results do not change. Throws UsageError once a scan was pushed.
  template <class Cloud>
  void reserve_like(const Cloud& example,
                    std::size_t scans = std::numeric_limits<std::size_t>::max()) {
    const detail::ReentrancyGuard::Guard guard(reentrancy_guard_);
    if (pushed_ > 0) throw UsageError("memory is reserved before the first push");
    if (scans == 0) return;
    const std::size_t points = PointCloudTraits<Cloud>::size(example);
    const std::size_t more = points + points / 16;  // scans of one sensor differ a little in size
    for (std::size_t i = 0; i < std::min(scans, ring_.size()); ++i) {
      ring_[i].touch(more);
    }
    const WarmUp rehearsal(*this);
    // The fourth scan has been held against another one, too.
    const auto enough = static_cast<std::size_t>(std::max(config_.window, 4));
    for (std::size_t i = 0; i < std::min(scans, enough); ++i) {
      take_in(example, Eigen::Isometry3d::Identity(), 0.1 * static_cast<double>(i));
    }
    for (ScanSlot& other : ring_) other.ensure_capacity_like(slot(pushed_ - 1));
    if (config_.use_free_space) detail::reserve_stage(evidence_, scans);
  }

  /// The same for scans of that many points, of a 64-beam sensor in a street.
  void reserve(std::size_t points) {
    const std::vector<float> xyz = detail::synthetic_scan(points);
    reserve_like(RawPoints<float>{xyz.data(), points});
  }

  /// Takes one scan in.
  ///
  /// `cloud`: metres, sensor frame, z up (tilts are found, see RemoverConfig::level); see
  /// PointCloudTraits for what can be passed. Any size, any content: bad points get a label of
  /// their own. `T_world_sensor`: pose of the sensor at that scan. `time`: s, greater than that of
  /// the scan before. Throws PoseError, and then leaves the state as it was; so does what the cloud
  /// throws. Where a stage throws (std::bad_alloc), the scan is not taken in, and the next one
  /// begins a new window, as behind a gap; evidence that it gave on older scans may remain. What is
  /// thrown while a scan becomes final, by the map above all, is of that scan: its final verdict is
  /// lost, and nothing else.
  template <class Cloud>
  FrameResult push(const Cloud& cloud, const Eigen::Isometry3d& T_world_sensor, double time) {
    const detail::ReentrancyGuard::Guard guard(reentrancy_guard_);
    return take_in(cloud, T_world_sensor, time);
  }

  /// The same at 0.1 s after the scan before; later by the least step of a double where 0.1 s is
  /// less than that (times beyond 1e15 s).
  template <class Cloud>
  FrameResult push(const Cloud& cloud, const Eigen::Isometry3d& T_world_sensor) {
    const detail::ReentrancyGuard::Guard guard(reentrancy_guard_);
    constexpr double kPeriod = 0.1;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const double next = std::max(last_time_ + kPeriod, std::nextafter(last_time_, kInfinity));
    return take_in(cloud, T_world_sensor, pushed_ == 0 ? 0.0 : next);
  }

  /// Makes the verdict on all scans final that are still open, oldest first; `sink` is called with
  /// the ScanVerdict of each. The next push starts a new window.
  template <class Sink>
  void flush(Sink&& sink) {
    const detail::ReentrancyGuard::Guard guard(reentrancy_guard_);
    check_owned();
    while (finished_ < pushed_) {
      StageClock clock;
      StageTimes times;
      sink(finish_next(clock, times));
    }
    ++segment_;
  }

  /// Back to the state after construction, with an empty map; buffers keep their capacity. The map
  /// is cleared: a TiledStaticMap removes its files, those of earlier runs, too. To start again and
  /// keep it, construct a new remover.
  void reset() {
    const detail::ReentrancyGuard::Guard guard(reentrancy_guard_);
    map_.clear();
    forget();
  }

 private:
  using ScanSlot = detail::ScanSlot;
  static constexpr std::size_t kFewestSlots = 2;  // ids go from scan to scan

  // While it lives, scans leave no trace, and none on the map, which may be on a disk.
  class WarmUp {
   public:
    explicit WarmUp(BasicDynaInsRemover& remover)
        : remover_(remover), build_map_(std::exchange(remover.config_.build_map, false)) {}
    WarmUp(const WarmUp&) = delete;
    WarmUp& operator=(const WarmUp&) = delete;
    ~WarmUp() {
      remover_.config_.build_map = build_map_;
      remover_.forget();
    }

   private:
    BasicDynaInsRemover& remover_;
    bool build_map_;
  };

  void forget() {
    revision_.clear();
    instance_ids_.clear();
    frame_.forget();
    pushed_ = 0;
    finished_ = 0;
    ++segment_;  // nothing that is remembered takes part any more
  }

  template <class Cloud>
  FrameResult take_in(const Cloud& cloud, const Eigen::Isometry3d& T_world_sensor, double time) {
    check_owned();
    validate_pose("T_world_sensor", T_world_sensor);
    validate_time(time);
    StageClock clock;
    // Until its points are in, a scan only fills a slot that is free: a foreign cloud may throw.
    ScanSlot& newest = slot(pushed_);
    newest.scan = pushed_;
    newest.segment = segment_ + (pushed_ > 0 && breaks_off(T_world_sensor, time) ? 1 : 0);
    newest.time = time;
    newest.T_world_sensor = orthonormalized(T_world_sensor);
    ingest(cloud, newest);
    return clean(newest, clock);
  }

  // Counts a scan in, and out again if a stage throws before it is kept: stages may have seen it,
  // so that the next one begins a new window.
  class PushTransaction {
   public:
    PushTransaction(BasicDynaInsRemover& remover, const ScanSlot& newest)
        : remover_(remover), time_before_(remover.last_time_) {
      ++remover_.pushed_;
      remover_.segment_ = newest.segment;
      remover_.last_time_ = newest.time;
    }
    PushTransaction(const PushTransaction&) = delete;
    PushTransaction& operator=(const PushTransaction&) = delete;
    ~PushTransaction() {
      if (kept_) return;
      --remover_.pushed_;
      ++remover_.segment_;
      remover_.last_time_ = time_before_;
    }
    void keep() { kept_ = true; }

   private:
    BasicDynaInsRemover& remover_;
    double time_before_;
    bool kept_ = false;
  };

  FrameResult clean(ScanSlot& newest, StageClock& clock);

  void check_owned() const {
    if (ring_.empty()) throw UsageError("this remover was moved from");
  }

  void validate_time(double time) const {
    if (!std::isfinite(time) || (pushed_ > 0 && !(time > last_time_))) {
      throw PoseError("time = " + std::to_string(time) + " s must be finite and greater than " +
                      (pushed_ > 0 ? std::to_string(last_time_) : std::string("-inf")) +
                      ", the time of the scan before");
    }
  }

  ScanSlot& slot(std::uint64_t scan) { return ring_[scan % ring_.size()]; }

  // Whether the scan before is too long ago, or too far away to be compared with.
  bool breaks_off(const Eigen::Isometry3d& T_world_sensor, double time) {
    const Eigen::Vector3d before = slot(pushed_ - 1).T_world_sensor.translation();
    return config_.breaks_off(time - last_time_, (T_world_sensor.translation() - before).norm());
  }

  // Eq. 3: the non-ground points of the last K scans in the frame of the newest.
  void gather_window() {
    const ScanSlot& newest = slot(pushed_ - 1);
    const auto length =
        std::min<std::uint64_t>(pushed_, static_cast<std::uint64_t>(config_.window));
    window_first_ = pushed_ - length;
    while (slot(window_first_).segment != newest.segment) ++window_first_;
    window_.clear();
    scan_begin_.clear();
    scan_begin_.push_back(0);
    const Eigen::Isometry3d T_newest_world = newest.T_world_level.inverse();
    for (std::uint64_t scan = window_first_; scan < pushed_; ++scan) {
      const ScanSlot& source = slot(scan);
      const Eigen::Isometry3d T_newest_source = T_newest_world * source.T_world_level;
      window_.append(source.split.non_ground(), T_newest_source.cast<float>());
      scan_begin_.push_back(static_cast<std::uint32_t>(window_.size()));
    }
  }

  // Eq. 5-19 for each cluster that the oldest and the newest scan saw; silence means static.
  void judge_clusters() {
    verdict_.assign(clusters_.size(), {0.0F, 0, detail::Reach::kTooFewScans});
    for (std::size_t c = 0; c < clusters_.size(); ++c) {
      if (!clusters_.comparable(c)) continue;
      verdict_[c].reach = detail::Reach::kSimilar;
      descriptor_.describe(clusters_[c]);
      if (!descriptor_.proposes_dynamic()) continue;
      if (!config_.use_belief) {
        verdict_[c] = {1.0F, 1, detail::Reach::kProposed};
        continue;
      }
      descriptor_.describe_rest();
      belief_.reset();
      for (std::size_t k = 0; k < clusters_.scan_count(); ++k) {
        belief_.update(descriptor_.heights(k), descriptor_.cluster_heights());
      }
      verdict_[c] = {static_cast<float>(belief_.posterior()),
                     static_cast<std::uint8_t>(belief_.is_dynamic() ? 1 : 0),
                     detail::Reach::kProposed};
    }
  }

  // From clusters to the points of every scan in the window.
  void record_verdicts(ScanSlot& newest) {
    const auto point_runs = clusters_.point_runs(clusters_.scan_count() - 1);
    newest.point_runs.assign(point_runs.begin(), point_runs.end());
    assign_ids(newest);
    detail::record_first(newest, verdict_);
    if (config_.votes == 0) return;
    for (std::uint64_t scan = window_first_; scan + 1 < pushed_; ++scan) {
      detail::record_again(slot(scan), clusters_.point_runs(scan - window_first_), verdict_, said_);
    }
  }

  void assign_ids(ScanSlot& newest) {
    detail::InstanceIds::PointRuns old_runs, point_runs;
    Span<const std::uint32_t> old_ids;
    if (window_first_ + 1 < pushed_) {
      const ScanSlot& before = slot(pushed_ - 2);
      old_runs = before.point_runs;
      old_ids = before.ids;
      point_runs = clusters_.point_runs(clusters_.scan_count() - 2);
    }
    instance_ids_.assign(old_runs, old_ids, point_runs, clusters_.size(), newest.ids);
  }

  // A window of one scan compares nothing, nor can it tell which instance was which: the evidence
  // does both.
  bool compares_windows() const { return config_.window > 1 || !config_.use_free_space; }

  void propagate_ids(ScanSlot& newest) {
    const bool alone = newest.scan == 0 || slot(newest.scan - 1).segment != newest.segment;
    const Span<const std::uint32_t> predecessors = evidence_.predecessors();
    instance_ids_.propagate(
        predecessors,
        alone ? Span<const std::uint32_t>() : Span<const std::uint32_t>(slot(newest.scan - 1).ids),
        newest.ids);
  }

  // Whether anything was left to be found in the scans.
  bool needs_sensor() const {
    return config_.use_free_space || config_.level || detail::needs_sensor(ground_) ||
           detail::needs_sensor(clusterer_);
  }

  // What depends on the sensor, from the first scan that has enough points.
  void adapt_to_sensor(ScanSlot& newest) {
    frame_.estimate(ingest_.points());
    if (sensor().known() && newest.scan > 0) newest.segment = ++segment_;
    const SensorModel model = sensor().known() ? sensor() : SensorModel::typical();
    try {
      detail::adapt_stage(ground_, model);
      detail::adapt_stage(clusterer_, model);
      evidence_.adapt(model);
    } catch (...) {
      frame_.forget();  // so that all of them are told by the next scan
      throw;
    }
  }

  // The points as a level sensor in the same place would see them that looks along the scene.
  template <class Cloud>
  void ingest(const Cloud& cloud, ScanSlot& newest) {
    const auto nearest = static_cast<float>(config_.min_range);
    const auto farthest = static_cast<float>(config_.max_range);
    newest.T_world_level = newest.T_world_sensor;
    if (frame_.turns()) {
      const Eigen::Matrix3f R_level_sensor = turn_pose(newest);
      ingest_.read(cloud, nearest, farthest, &R_level_sensor, newest.labels);
    } else {
      ingest_.read(cloud, nearest, farthest, nullptr, newest.labels);
    }
  }

  // The turn of the points that makes the sensor level; done to the scan's pose.
  Eigen::Matrix3f turn_pose(ScanSlot& newest) const {
    const Eigen::Matrix3d R_level_sensor = sensor().R_level_sensor();
    newest.T_world_level.rotate(R_level_sensor.transpose());
    return R_level_sensor.cast<float>();
  }

  // Final verdict by point: at least `votes` windows said so, or the evidence does.
  void decide(ScanSlot& scan, int votes, StageClock& clock, StageTimes& times) {
    if (config_.use_free_space) {
      const EvidenceVerdict said = evidence_.judge(scan.scan, true, scan.split);
      clock.lap(times.judge);
      detail::rewrite_by_evidence(scan, said, compares_windows(), votes, verdict_scratch_);
    } else {
      detail::rewrite_by_windows(scan, votes);
    }
    clock.lap(times.verdict);
  }

  ScanVerdict finish_next(StageClock& clock, StageTimes& times);

  void revise_map(const ScanSlot& newest) {
    if constexpr (kRevisable) {
      revision_.revise(
          map_, newest.scan, newest.T_world_sensor.translation(),
          [this](const PointBuffer& points, std::size_t count, const Eigen::Isometry3d& T)
              -> const auto& { return evidence_.see(points, count, T); });
    }
  }

  Config config_;
  Ground ground_;
  Clusterer clusterer_;
  Descriptor descriptor_;
  Belief belief_;
  Evidence evidence_;
  Map map_;
  MapRevision revision_;
  detail::LevelFrame frame_;

  detail::Ingest ingest_;
  std::vector<ScanSlot> ring_;
  PolarBuffer window_;
  std::vector<std::uint32_t> scan_begin_;
  ClusterSet clusters_;
  std::vector<detail::ClusterVerdict> verdict_;
  std::vector<detail::Reach> said_;  // of one scan, by the window at hand
  detail::VerdictScratch verdict_scratch_;
  detail::InstanceIds instance_ids_;

  detail::ReentrancyGuard reentrancy_guard_;
  std::uint64_t pushed_ = 0;
  std::uint64_t finished_ = 0;
  std::uint64_t window_first_ = 0;
  std::uint64_t segment_ = 0;
  double last_time_ = 0.0;
};

// What calls the stages is defined outside of the class: a unit that declares
// `extern template class BasicDynaInsRemover<>` leaves it out, and two thirds of its compile time.

// Everything behind the foreign cloud: its points have been taken in.
template <class Stages>
FrameResult BasicDynaInsRemover<Stages>::clean(ScanSlot& newest, StageClock& clock) {
  FrameResult result;
  PushTransaction taking(*this, newest);
  newest.ensure_capacity(newest.labels.size());
  if (needs_sensor() && !sensor().known()) {
    adapt_to_sensor(newest);
    if (frame_.turns()) ingest_.turn(turn_pose(newest));
  }
  clock.lap(result.times.ingest);

  ground_.segment(ingest_.points(), ingest_.input(), newest.split);
  clock.lap(result.times.ground);

  gather_window();
  clock.lap(result.times.window);

  const Span<const std::uint32_t> cluster_of = clusterer_.cluster(window_.view());
  if (cluster_of.size() != window_.size()) {
    throw UsageError("Stages::Clusterer gave " + std::to_string(cluster_of.size()) +
                     " cluster numbers for " + std::to_string(window_.size()) + " points");
  }
  if (compares_windows()) {
    clusters_.build(window_.view(), scan_begin_, cluster_of, clusterer_.cluster_count());
  }
  clock.lap(result.times.cluster);

  if (compares_windows()) judge_clusters();
  clock.lap(result.times.descriptor);

  if (compares_windows()) record_verdicts(newest);
  clock.lap(result.times.verdict);
  const std::size_t count = newest.non_ground_count();
  const auto newest_cluster = cluster_of.subspan(cluster_of.size() - count, count);
  if (config_.use_free_space) {
    evidence_.observe(newest.scan, newest.segment, newest.T_world_level, newest.split,
                      newest_cluster, clusterer_.cluster_count());
    if (!compares_windows()) propagate_ids(newest);
  }
  clock.lap(result.times.evidence);
  if (config_.use_free_space) {
    const EvidenceVerdict said = evidence_.judge(newest.scan, false, newest.split);
    clock.lap(result.times.judge);
    detail::write_instances(newest, newest_cluster);
    detail::write_by_evidence(newest, said, compares_windows(), verdict_scratch_);
  } else {
    detail::begin_verdict(newest);
    detail::write_by_windows(newest, verdict_);
  }
  clock.lap(result.times.verdict);
  result.newest = newest.verdict();
  taking.keep();

  if (pushed_ - finished_ > latency()) result.finished = finish_next(clock, result.times);
  if (config_.revision.revise_map) revise_map(newest);
  clock.lap(result.times.revision);
  return result;
}

template <class Stages>
ScanVerdict BasicDynaInsRemover<Stages>::finish_next(StageClock& clock, StageTimes& times) {
  ScanSlot& scan = slot(finished_++);  // also if something throws: its slot is needed by then
  decide(scan, std::max(1, config_.votes), clock, times);
  if (config_.build_map) {
    const PointsView points = PointsView(scan.split.points).subview(0, scan.split.count);
    map_.insert(points, scan.is_kept, scan.T_world_level);
  }
  clock.lap(times.map);
  return scan.verdict();
}

using DynaInsRemover = BasicDynaInsRemover<>;

}  // namespace dynains
