// The decision by free space: beams of other scans that passed through the place of a point.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>

#include "dynains/config.hpp"
#include "dynains/map/map_revision.hpp"
#include "dynains/pipeline/instance_ids.hpp"
#include "dynains/pipeline/scan_decision.hpp"
#include "dynains/points.hpp"
#include "dynains/stage/contracts.hpp"
#include "dynains/stage/evidence_verdict.hpp"

namespace dynains::detail {

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

}  // namespace dynains::detail
