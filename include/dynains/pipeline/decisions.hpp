// The decisions that Config::decision names: window, free_space or both.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "dynains/config.hpp"
#include "dynains/map/map_revision.hpp"
#include "dynains/pipeline/instance_ids.hpp"
#include "dynains/pipeline/scan_ring.hpp"
#include "dynains/pipeline/scan_window.hpp"
#include "dynains/pipeline/stage_checks.hpp"
#include "dynains/pipeline/verdict_writer.hpp"
#include "dynains/pipeline/window_votes.hpp"
#include "dynains/points.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/stage/cluster_set.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

/// Measures the stages of one call.
class StageTimer {
 public:
  const StageTimes& times() const { return times_; }

  /// Runs `work` and adds its time to a field of times().
  template <class Work>
  void measure(double StageTimes::*stage, Work&& work) {
    const auto begin = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - begin;
    times_.*stage += time.count();
  }

 private:
  StageTimes times_;
};

/// Collects evidence about scans and decides which of their points are dynamic. For each scan:
/// observe(), then judge_newest(), then, latency() scans later, judge_final().
template <class Map>
class ScanDecision {
 public:
  virtual ~ScanDecision() = default;

  /// Scans whose points are clustered together.
  virtual std::size_t window_length() const = 0;
  /// Scans between observe() and judge_final().
  virtual std::size_t latency() const = 0;

  virtual bool needs_sensor() const = 0;
  virtual void adapt(const SensorModel& sensor) = 0;
  /// Gets memory for so many scans. Called after some scans were observed that are forgotten then.
  virtual void reserve(std::size_t scans) = 0;

  /// Takes the newest scan in, and gives each of its clusters an instance id.
  virtual void observe(ScanRing& scans, const ScanWindow& window, StageTimer& timer) = 0;
  /// Verdict on the newest scan from what is known without later scans. The writer has begun it.
  virtual void judge_newest(ScanSlot& newest, VerdictWriter& writer, StageTimer& timer) = 0;
  /// Verdict that later scans do not change any more.
  virtual void judge_final(ScanSlot& scan, VerdictWriter& writer, StageTimer& timer) = 0;

  /// Takes points out of the map whose place the newest scan sees free.
  virtual void revise(Map& /*map*/, const ScanSlot& /*newest*/) {}
  /// Back to the state after construction, but for capacity.
  virtual void clear() = 0;
};

/// Compares the scans of a window cluster by cluster, and keeps the votes of all windows that see a
/// scan. Ids go from scan to scan with the points that two windows share.
template <class Stages>
class WindowDecision final : public ScanDecision<typename Stages::Map> {
 public:
  explicit WindowDecision(const PipelineConfig<Stages>& config)
      : length_(static_cast<std::size_t>(config.window)),
        votes_(config.votes),
        use_belief_(config.use_belief),
        observations_(config.belief_observations),
        descriptor_(config.descriptor),
        belief_(config.belief) {}

  std::size_t window_length() const override { return length_; }
  std::size_t latency() const override { return votes_ == 0 ? 0 : length_ - 1; }
  bool needs_sensor() const override { return false; }
  void adapt(const SensorModel&) override {}
  void reserve(std::size_t) override {}
  void clear() override { instance_ids_.clear(); }

  void observe(ScanRing& scans, const ScanWindow& window, StageTimer& timer) override {
    timer.measure(&StageTimes::cluster, [&] {
      clusters_.build(window.points(), window.scan_begin(), window.cluster_of(),
                      window.cluster_count());
    });
    timer.measure(&StageTimes::descriptor, [&] { judge_clusters(); });
    timer.measure(&StageTimes::verdict, [&] { record(scans, window.first_scan()); });
  }

  void judge_newest(ScanSlot& newest, VerdictWriter& writer, StageTimer& timer) override {
    timer.measure(&StageTimes::verdict, [&] {
      writer.write_runs(newest, newest.windows.point_runs, [this](std::uint32_t cluster) {
        return cluster == kNoCluster ? PointVerdict() : point_verdict(verdicts_[cluster]);
      });
    });
  }

  void judge_final(ScanSlot& scan, VerdictWriter& writer, StageTimer& timer) override {
    timer.measure(&StageTimes::verdict, [&] {
      writer.begin_final(scan);
      const VerdictWriter::Points points = writer.points(scan);
      const std::size_t first = scan.split.ground_count;
      WindowVoter::for_each_unsettled(scan.non_ground_count(), scan.windows, [&](std::size_t i) {
        points.write(first + i, point_verdict(scan.windows, i, votes_needed()));
      });
    });
  }

  /// Windows that must call a point dynamic for the final verdict.
  int votes_needed() const { return std::max(1, votes_); }

 private:
  // Eq. 5-19 for each cluster that both the oldest and the newest scan saw; others are static.
  void judge_clusters() {
    verdicts_.assign(clusters_.size(), {0.0F, 0, DecisionStage::kTooFewScans});
    for (std::size_t c = 0; c < clusters_.size(); ++c) {
      if (!clusters_.comparable(c)) continue;
      verdicts_[c].stage = DecisionStage::kSimilar;
      descriptor_.describe(clusters_[c]);             // Eq. 5-10
      if (!descriptor_.proposes_dynamic()) continue;  // Eq. 11-12
      verdicts_[c] = {1.0F, 1, DecisionStage::kProposed};
      if (use_belief_) update_belief(verdicts_[c]);
    }
  }

  // Eq. 13-19 on the cluster that was described last.
  void update_belief(ClusterVerdict& verdict) {
    descriptor_.describe_rest();
    belief_.reset();
    const std::size_t last = clusters_.scan_count() - 1;
    const bool is_sequence = observations_ == BeliefObservations::kSequence;
    const std::size_t first = is_sequence                                    ? 1
                              : observations_ == BeliefObservations::kNewest ? last
                                                                             : 0;
    for (std::size_t k = first; k <= last; ++k) {
      belief_.update(descriptor_.heights(k), descriptor_.cluster_heights(is_sequence ? k : last));
    }
    verdict.belief = static_cast<float>(belief_.posterior());
    verdict.is_dynamic = belief_.is_dynamic() ? 1 : 0;
  }

  // From clusters to the points of every scan in the window.
  void record(ScanRing& scans, std::uint64_t first_scan) {
    ScanSlot& newest = scans.newest();
    const Span<const ClusterSet::PointRun> runs = clusters_.point_runs(clusters_.scan_count() - 1);
    newest.windows.point_runs.assign(runs.begin(), runs.end());
    assign_ids(scans);
    WindowVoter::record_first(newest.non_ground_count(), verdicts_, newest.windows);
    if (votes_ == 0) return;
    for (std::uint64_t scan = first_scan; scan < newest.scan; ++scan) {
      voter_.record_again(scans[scan].non_ground_count(), clusters_.point_runs(scan - first_scan),
                          verdicts_, scans[scan].windows);
    }
  }

  void assign_ids(ScanRing& scans) {
    ScanSlot& newest = scans.newest();
    InstanceIds::PointRuns old_runs, point_runs;
    Span<const std::uint32_t> old_ids;
    if (clusters_.scan_count() > 1) {
      const ScanSlot& before = scans[newest.scan - 1];
      old_runs = before.windows.point_runs;
      old_ids = before.ids;
      point_runs = clusters_.point_runs(clusters_.scan_count() - 2);
    }
    instance_ids_.assign(old_runs, old_ids, point_runs, clusters_.size(), newest.ids);
  }

  std::size_t length_;
  int votes_;
  bool use_belief_;
  BeliefObservations observations_;
  typename Stages::Descriptor descriptor_;
  typename Stages::Belief belief_;
  ClusterSet clusters_;
  std::vector<ClusterVerdict> verdicts_;  // by cluster of the window at hand
  WindowVoter voter_;
  InstanceIds instance_ids_;
};

/// Clusters each scan alone; ids follow the instances that the evidence finds again.
template <class Stages>
class FreeSpaceDecision final : public ScanDecision<typename Stages::Map> {
 public:
  using Map = typename Stages::Map;
  using Evidence = typename PipelineConfig<Stages>::Evidence;

  explicit FreeSpaceDecision(const PipelineConfig<Stages>& config)
      : evidence_(config.evidence), revision_(config.revision) {}

  std::size_t window_length() const override { return 1; }
  std::size_t latency() const override { return evidence_.lookahead_scans(); }
  bool needs_sensor() const override { return true; }
  void adapt(const SensorModel& sensor) override { evidence_.adapt(sensor); }
  void reserve(std::size_t scans) override { reserve_stage(evidence_, scans); }
  void clear() override {
    revision_.clear();
    instance_ids_.clear();
  }

  /// Lets scans up to that many behind the newest be judged, if these are more than latency().
  void keep(std::size_t scans) { keep_in_stage(evidence_, scans); }

  void observe(ScanRing& scans, const ScanWindow& window, StageTimer& timer) override {
    timer.measure(&StageTimes::evidence, [&] {
      observe_instances(scans.newest(), window);
      propagate_ids(scans);
    });
  }
  /// Takes the newest scan in without ids.
  void observe_instances(const ScanSlot& newest, const ScanWindow& window) {
    evidence_.observe(newest.scan, newest.epoch, newest.T_world_level, newest.split,
                      window.newest_cluster_of(), window.cluster_count());
  }

  void judge_newest(ScanSlot& newest, VerdictWriter& writer, StageTimer& timer) override {
    write_newest(newest, writer, timer);
  }
  void judge_final(ScanSlot& scan, VerdictWriter& writer, StageTimer& timer) override {
    write_final(scan, writer, timer);
  }
  /// The same; give the verdict that was written, which holds until the next call.
  EvidenceVerdict write_newest(ScanSlot& newest, VerdictWriter& writer, StageTimer& timer) {
    const EvidenceVerdict verdict = judge(newest, false, timer);
    timer.measure(&StageTimes::verdict, [&] { writer.write_groups(newest, verdict); });
    return verdict;
  }
  EvidenceVerdict write_final(ScanSlot& scan, VerdictWriter& writer, StageTimer& timer) {
    const EvidenceVerdict verdict = judge(scan, true, timer);
    timer.measure(&StageTimes::verdict, [&] {
      writer.begin_final(scan);
      writer.rewrite_groups(scan, verdict);
    });
    return verdict;
  }

  void revise(Map& map, const ScanSlot& newest) override {
    if constexpr (IsRevisable<Map, Evidence>::value) {
      if (!revision_.config().revise_map) return;
      revision_.revise(
          map, newest.scan, newest.T_world_sensor.translation(),
          [this](const PointBuffer& points, std::size_t count,
                 const Eigen::Isometry3d& T_world_points) -> const auto& {
            return evidence_.test_visibility(points, count, T_world_points);
          });
    }
  }

 private:
  EvidenceVerdict judge(const ScanSlot& scan, bool is_final, StageTimer& timer) {
    EvidenceVerdict verdict;
    timer.measure(&StageTimes::judge,
                  [&] { verdict = evidence_.judge(scan.scan, is_final, scan.split); });
    return verdict;
  }

  void propagate_ids(ScanRing& scans) {
    ScanSlot& newest = scans.newest();
    Span<const std::uint32_t> old_ids;
    if (newest.scan > 0) {
      const ScanSlot& before = scans[newest.scan - 1];
      if (before.epoch == newest.epoch) old_ids = before.ids;
    }
    instance_ids_.propagate(evidence_.predecessors(), old_ids, newest.ids);
  }

  Evidence evidence_;
  MapRevision revision_;
  InstanceIds instance_ids_;
};

/// Dynamic if either verdict is, the first one's cause before the second one's; the higher belief.
inline PointVerdict stronger(const PointVerdict& first, const PointVerdict& second) {
  const bool takes_second = !is_dynamic(first.cause) && is_dynamic(second.cause);
  return {takes_second ? second.cause : first.cause, std::max(first.belief, second.belief)};
}

/// Adds what windows proposed so far to the verdict by free space that was written last.
inline void add_proposals(ScanSlot& scan, const EvidenceVerdict& by_free_space, int votes_needed,
                          VerdictWriter& writer) {
  const VerdictWriter::Points points = writer.points(scan);
  const std::size_t first = scan.split.ground_count;
  for (std::size_t i = 0; i < scan.non_ground_count(); ++i) {
    if (scan.windows.stage[i] != DecisionStage::kProposed) continue;
    const PointVerdict& group = by_free_space.groups[by_free_space.group_of[i]];
    points.write(first + i, stronger(group, point_verdict(scan.windows, i, votes_needed)));
  }
}

/// Free space decides on all points; windows add what they propose. Clusters, and with them ids,
/// are those of the windows.
template <class Stages>
class BothDecisions final : public ScanDecision<typename Stages::Map> {
 public:
  explicit BothDecisions(const PipelineConfig<Stages>& config)
      : window_(config), free_space_(config) {
    free_space_.keep(latency());
  }

  std::size_t window_length() const override { return window_.window_length(); }
  std::size_t latency() const override {
    return std::max(window_.latency(), free_space_.latency());
  }
  bool needs_sensor() const override { return free_space_.needs_sensor(); }
  void adapt(const SensorModel& sensor) override { free_space_.adapt(sensor); }
  void reserve(std::size_t scans) override { free_space_.reserve(scans); }
  void clear() override {
    window_.clear();
    free_space_.clear();
  }

  void observe(ScanRing& scans, const ScanWindow& window, StageTimer& timer) override {
    window_.observe(scans, window, timer);
    timer.measure(&StageTimes::evidence,
                  [&] { free_space_.observe_instances(scans.newest(), window); });
  }
  void judge_newest(ScanSlot& newest, VerdictWriter& writer, StageTimer& timer) override {
    const EvidenceVerdict by_free_space = free_space_.write_newest(newest, writer, timer);
    timer.measure(&StageTimes::verdict, [&] { add_proposals(newest, by_free_space, 1, writer); });
  }
  void judge_final(ScanSlot& scan, VerdictWriter& writer, StageTimer& timer) override {
    const EvidenceVerdict by_free_space = free_space_.write_final(scan, writer, timer);
    timer.measure(&StageTimes::verdict,
                  [&] { add_proposals(scan, by_free_space, window_.votes_needed(), writer); });
  }
  void revise(typename Stages::Map& map, const ScanSlot& newest) override {
    free_space_.revise(map, newest);
  }

 private:
  WindowDecision<Stages> window_;
  FreeSpaceDecision<Stages> free_space_;
};

/// The decision that `config.decision` names.
template <class Stages>
std::unique_ptr<ScanDecision<typename Stages::Map>> make_decision(
    const PipelineConfig<Stages>& config) {
  switch (config.decision) {
    case Decision::kWindow:
      return std::make_unique<WindowDecision<Stages>>(config);
    case Decision::kBoth:
      return std::make_unique<BothDecisions<Stages>>(config);
    case Decision::kFreeSpace:
      break;
  }
  return std::make_unique<FreeSpaceDecision<Stages>>(config);
}

}  // namespace dynains::detail
