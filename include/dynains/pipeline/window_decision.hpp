// The paper's decision: occupancy of clusters within a sliding window, belief and votes
// (Eq. 4-19).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/config.hpp"
#include "dynains/pipeline/instance_ids.hpp"
#include "dynains/pipeline/scan_decision.hpp"
#include "dynains/pipeline/window_votes.hpp"
#include "dynains/stage/cluster_set.hpp"

namespace dynains::detail {

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

}  // namespace dynains::detail
