// Decisions on scans: their interface, and that by windows.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dynains/clusters/cluster_set.hpp"
#include "dynains/config.hpp"
#include "dynains/errors.hpp"
#include "dynains/pipeline/scan_ring.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/registration/motion_stage.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/threads/background.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

/// Finds the clusters of the previous scan that go on in those of the current window.
class ClusterPredecessors {
 public:
  using PointRuns = Span<const ClusterSet::PointRun>;

  /// By cluster of this window, its old cluster, or kNoCluster. `old_runs` and `point_runs`: point
  /// runs of the previous scan, with its old clusters and with the clusters of this window. It is
  /// the one with more than half of the points of the cluster in the previous scan; without a
  /// majority, it has some of them. The span is valid until the next call.
  Span<const std::uint32_t> find(PointRuns old_runs, PointRuns point_runs,
                                 std::size_t cluster_count) {
    candidate_.assign(cluster_count, kNoCluster);
    lead_.assign(cluster_count, 0);
    for_each_common_run(point_runs, old_runs,
                        [this](std::uint32_t begin, std::uint32_t end, const auto& run,
                               const auto& old) { vote(run.cluster, old.cluster, end - begin); });
    return candidate_;
  }

 private:
  // Majority vote of Boyer and Moore, with one candidate and one counter per cluster.
  void vote(std::uint32_t cluster, std::uint32_t old_cluster, std::uint32_t points) {
    if (cluster == kNoCluster || old_cluster == kNoCluster) return;
    std::uint32_t& lead = lead_[cluster];
    if (candidate_[cluster] == old_cluster) {
      lead += points;
    } else if (points <= lead) {
      lead -= points;
    } else {
      candidate_[cluster] = old_cluster;
      lead = points - lead;
    }
  }

  std::vector<std::uint32_t> candidate_;
  std::vector<std::uint32_t> lead_;
};

/// Numbers the instances of consecutive scans.
class InstanceIds {
 public:
  /// Restarts the numbering.
  void clear() { last_id_ = kNoInstance; }

  /// Fills `ids` by cluster. `predecessors`: by cluster, its old cluster (index into `old_ids`),
  /// whose id it inherits, or kNoCluster, which gives a new id. If two clusters have one
  /// predecessor, the one with the higher index gets a new id.
  void propagate(Span<const std::uint32_t> predecessors, Span<const std::uint32_t> old_ids,
                 std::vector<std::uint32_t>& ids) {
    is_inherited_.assign(old_ids.size(), 0);
    ids.resize(predecessors.size());
    for (std::size_t c = 0; c < predecessors.size(); ++c) {
      const std::uint32_t old = predecessors[c];
      if (old != kNoCluster && is_inherited_[old] == 0) {
        is_inherited_[old] = 1;
        ids[c] = old_ids[old];
      } else {
        if (++last_id_ == kNoInstance) ++last_id_;  // skipped after an overflow
        ids[c] = last_id_;
      }
    }
  }

 private:
  std::uint32_t last_id_ = kNoInstance;
  std::vector<std::uint8_t> is_inherited_;
};

/// Non-ground points of consecutive scans in m, level frame of the newest scan, oldest scan first.
class ScanWindow {
 public:
  /// Collects the last `length` scans, or fewer if the epoch of the newest scan has fewer.
  void gather(ScanRing& scans, std::size_t length) {
    const ScanSlot& newest = scans.newest();
    first_scan_ = scans.pushed() - std::min<std::uint64_t>(scans.pushed(), length);
    while (scans[first_scan_].compared.epoch != newest.compared.epoch) ++first_scan_;
    points_.clear();
    scan_begin_.assign(1, 0);
    const Pose T_newest_world = inverted(newest.T_world_level);
    for (std::uint64_t scan = first_scan_; scan < scans.pushed(); ++scan) {
      points_.append(scans[scan].split.non_ground(),
                     composed(T_newest_world, scans[scan].T_world_level));
      scan_begin_.push_back(static_cast<std::uint32_t>(points_.size()));
    }
  }

  /// Clusters the points of the window. Throws UsageError unless the clusterer returns one number
  /// per point.
  template <class Clusterer>
  void cluster(Clusterer& clusterer) {
    cluster_of_ = clusterer.cluster(points_.view());
    cluster_count_ = clusterer.cluster_count();
    if (cluster_of_.size() == points_.size()) return;
    throw UsageError("Stages::Clusterer gave " + std::to_string(cluster_of_.size()) +
                     " cluster numbers for " + std::to_string(points_.size()) + " points");
  }

  /// Number of the oldest scan.
  std::uint64_t first_scan() const { return first_scan_; }
  std::size_t scan_count() const { return scan_begin_.size() - 1; }
  PolarView points() const { return points_.view(); }
  /// Index of the first point of each scan, and the number of points as last element.
  Span<const std::uint32_t> scan_begin() const { return scan_begin_; }

  std::size_t cluster_count() const { return cluster_count_; }
  /// Cluster number of each point, or kNoCluster. Valid until the clusterer is called again.
  Span<const std::uint32_t> cluster_of() const { return cluster_of_; }
  /// Cluster number of each point of the newest scan, or kNoCluster.
  Span<const std::uint32_t> newest_cluster_of() const {
    const std::size_t begin = scan_begin_[scan_count() - 1];
    return cluster_of_.subspan(begin, cluster_of_.size() - begin);
  }

 private:
  std::uint64_t first_scan_ = 0;
  PolarBuffer points_;
  std::vector<std::uint32_t> scan_begin_;
  Span<const std::uint32_t> cluster_of_;
  std::size_t cluster_count_ = 0;
};

/// Collects evidence on scans and classifies their points as static or dynamic. The caller calls
/// observe() and judge() for each scan, and judge() again for the same scan after latency() later
/// scans, each followed by verdict().
class ScanDecision {
 public:
  virtual ~ScanDecision() = default;

  /// Number of scans that are clustered together.
  virtual std::size_t window_length() const = 0;
  /// Number of later scans before the final judge().
  virtual std::size_t latency() const = 0;

  virtual bool needs_sensor() const = 0;
  /// Takes the models of the sensors of a scan, and that of all together.
  virtual void adapt(const SensorModel& all, Span<const SensorModel> sensors) = 0;

  /// Adds the newest scan. Returns by cluster of the window the cluster of the window before that
  /// goes on in it, or kNoCluster; valid until the next call.
  virtual Span<const std::uint32_t> observe(ScanRing& scans, const ScanWindow& window) = 0;
  /// Judges `scan`. Without `is_final` it is the newest scan, and evidence of later scans is
  /// missing.
  virtual void judge(const ScanSlot& scan, bool is_final) = 0;
  /// Verdict on the scan of the last judge() with the same `is_final`. The final verdict on an
  /// older scan may come before that on the newest one. The spans are valid until the next call.
  virtual EvidenceVerdict verdict(const ScanSlot& scan, bool is_final) = 0;

  /// By non-ground point of the newest scan: 0 if it does not move. Empty unless it is a reference
  /// for others. Call it, and then make_reference() unless it is empty, after the first judge().
  virtual std::optional<Span<const std::uint8_t>> may_move() { return std::nullopt; }
  virtual void make_reference(const ScanSlot&) {}

  /// Free and hit samples of the newest scan, by references of earlier scans.
  virtual SurfaceCounts surfaces() const { return {}; }
};

/// Decision by occupancy (Eq. 3-19): compares the scans of a window cluster by cluster and
/// accumulates the votes of all windows that contain a scan.
template <class Stages>
class WindowDecision final : public ScanDecision {
 public:
  explicit WindowDecision(const PipelineConfig<Stages>& config)
      : length_(static_cast<std::size_t>(config.window)),
        votes_(config.votes),
        use_belief_(config.use_belief),
        observations_(config.belief_observations),
        compared_(config.compared_clusters),
        big_is_static_(config.big_is_static),
        descriptor_(config.descriptor),
        belief_(config.belief) {
    if constexpr (HasBeliefGrid<DescriptorConfig>::value) {
      const auto of_belief = config.descriptor.of_belief();
      if (of_belief) belief_descriptor_.emplace(*of_belief);
    }
  }

  std::size_t window_length() const override { return length_; }
  std::size_t latency() const override { return votes_ == 0 ? 0 : length_ - 1; }
  bool needs_sensor() const override { return false; }
  void adapt(const SensorModel&, Span<const SensorModel>) override {}

  Span<const std::uint32_t> observe(ScanRing& scans, const ScanWindow& window) override {
    clusters_.build(window.points(), window.scan_begin(), window.cluster_of(),
                    window.cluster_count(), compared_);
    judge_clusters();
    record(scans, window.first_scan());
    ClusterPredecessors::PointRuns old_runs, point_runs;
    if (clusters_.scan_count() > 1) {
      old_runs = scans[scans.newest().scan - 1].windows.point_runs;
      point_runs = clusters_.point_runs(clusters_.scan_count() - 2);
    }
    return predecessors_.find(old_runs, point_runs, clusters_.size());
  }

  // The windows have voted already.
  void judge(const ScanSlot&, bool) override {}
  EvidenceVerdict verdict(const ScanSlot& scan, bool is_final) override {
    groups_.assign(1, {});
    cluster_of_.clear();
    resize_with_margin(group_of_, scan.non_ground_count());
    for_each_common_run(
        scan.windows.runs, scan.windows.point_runs,
        [&](std::uint32_t begin, std::uint32_t end, const WindowVotes::Run& run,
            const ClusterSet::PointRun& point_run) {
          const auto group = static_cast<std::uint32_t>(groups_.size());
          groups_.push_back(point_verdict(run.verdict, is_final ? std::max(1, votes_) : 1));
          cluster_of_.push_back(point_run.cluster);
          std::fill(&group_of_[begin], group_of_.data() + end, group);
        });
    return {groups_, cluster_of_, group_of_, {}};
  }

 private:
  using DescriptorConfig = typename Stages::Descriptor::Config;
  template <class Config>
  using BeliefGrid = decltype(std::declval<const Config&>().of_belief());
  template <class Config>
  using HasBeliefGrid = Offers<BeliefGrid, Config>;

  // Eq. 5-19 for each cluster that is compared. Other clusters are static.
  void judge_clusters() {
    verdicts_.assign(clusters_.size(), {0.0F, 0, DecisionStage::kTooFewScans});
    for (std::size_t c = 0; c < clusters_.size(); ++c) {
      if (!clusters_.comparable(c)) continue;
      verdicts_[c].stage = DecisionStage::kSimilar;
      descriptor_.describe(clusters_[c]);             // Eq. 5-10
      if (!descriptor_.proposes_dynamic()) continue;  // Eq. 11-12
      if (big_is_static_ && is_big(clusters_[c])) {
        verdicts_[c] = {0.0F, 0, DecisionStage::kProposed};
        continue;
      }
      verdicts_[c] = {1.0F, 1, DecisionStage::kProposed};
      const bool has_belief = compared_ == Comparison::kEnds || clusters_[c].oldest() == 0;
      if (use_belief_ && has_belief) update_belief(clusters_[c], verdicts_[c]);
    }
  }

  // The rules of the public implementation for clusters that are not judged.
  static bool is_big(const ClusterView& cluster) {
    Eigen::AlignedBox3f box;
    for (const PointRange& part : cluster.ranges) {
      for (std::size_t i = part.begin; i < part.end; ++i) {
        const float range = cluster.window.range[i], azimuth = cluster.window.azimuth[i];
        box.extend(Eigen::Vector3f(range * std::cos(azimuth), range * std::sin(azimuth),
                                   cluster.window.z[i]));
      }
    }
    const auto points = [&](std::size_t k) {
      std::uint32_t count = 0;
      for (const PointRange& part : cluster.scan(k)) count += part.end - part.begin;
      return count;
    };
    return box.diagonal().head<2>().norm() > 25.0F || box.diagonal().z() > 3.5F ||  // m
           box.max().z() > 3.5F ||
           std::max(points(cluster.oldest()), points(cluster.scan_count() - 1)) <= 3;
  }

  // Eq. 13-19 for the cluster of the last call of describe().
  void update_belief(const ClusterView& cluster, WindowVerdict& verdict) {
    if (belief_descriptor_) belief_descriptor_->describe(cluster);
    auto& descriptor = belief_descriptor_ ? *belief_descriptor_ : descriptor_;
    descriptor.describe_rest();
    belief_.reset();
    const std::size_t count = clusters_.scan_count();
    if (observations_ == BeliefObservations::kNewest) {
      belief_.update(descriptor.heights(count - 1), descriptor.cluster_heights(count - 1));
    }
    for (std::size_t k = 0; observations_ == BeliefObservations::kOthers && k < count; ++k) {
      if (cluster.scan(k).empty()) continue;
      belief_.update(descriptor.heights(k), heights_of_others(descriptor, count, k));
    }
    verdict.belief = static_cast<float>(belief_.posterior());
    verdict.votes = belief_.is_dynamic() ? 1 : 0;
  }

  // Maximum of the heights of all `scans` observations but k, by cell.
  Span<const float> heights_of_others(typename Stages::Descriptor& descriptor, std::size_t scans,
                                      std::size_t k) {
    others_.assign(descriptor.heights(k).size(), 0.0F);
    for (std::size_t other = 0; other < scans; ++other) {
      if (other == k) continue;
      const Span<const float> heights = descriptor.heights(other);
      for (std::size_t i = 0; i < others_.size(); ++i) {
        others_[i] = std::max(others_[i], heights[i]);
      }
    }
    return others_;
  }

  // Records the verdicts on clusters as votes on the points of every scan in the window.
  void record(ScanRing& scans, std::uint64_t first_scan) {
    ScanSlot& newest = scans.newest();
    newest.windows.begin(clusters_.point_runs(clusters_.scan_count() - 1));
    for (std::uint64_t scan = votes_ == 0 ? newest.scan : first_scan; scan <= newest.scan; ++scan) {
      scans[scan].windows.record(clusters_.point_runs(scan - first_scan), verdicts_, merged_);
    }
  }

  std::size_t length_;
  int votes_;
  bool use_belief_;
  BeliefObservations observations_;
  Comparison compared_;
  bool big_is_static_;
  typename Stages::Descriptor descriptor_;
  std::optional<typename Stages::Descriptor> belief_descriptor_;  // nothing: descriptor_
  std::vector<float> others_;
  typename Stages::Belief belief_;
  ClusterSet clusters_;
  std::vector<WindowVerdict> verdicts_;         // by cluster of the current window
  std::vector<WindowVotes::Run> merged_;        // working memory
  std::vector<EvidenceVerdict::Group> groups_;  // none, then by run of points
  std::vector<std::uint32_t> cluster_of_, group_of_;
  ClusterPredecessors predecessors_;
};

/// Creates the decision by free space. free_space_decision.hpp defines it, and the library
/// dynains::remover contains it. `other`: see make_decision().
template <class Config>
std::unique_ptr<ScanDecision> make_free_space_decision(const Config& config, Background* other);

/// Creates the motion stage of the decision by free space; free_space_decision.hpp defines it.
template <class Config>
std::unique_ptr<MotionStage> make_pose_correction(const Config& config);

/// The motion stage of a configuration; null if scans are compared by their pushed poses.
inline std::unique_ptr<MotionStage> make_motion(const RemoverConfig& config,
                                                const FreeSpaceConfig& evidence) {
  if (config.decision == Decision::kWindow || evidence.pose_tolerance == 0.0) return nullptr;
  return make_pose_correction(evidence);
}

/// Creates the implementation of `config.decision`. `other`: its second thread, which outlives it;
/// null for none.
template <class Stages>
std::unique_ptr<ScanDecision> make_decision(const PipelineConfig<Stages>& config,
                                            Background* other) {
  if (config.decision == Decision::kWindow) return std::make_unique<WindowDecision<Stages>>(config);
  return make_free_space_decision(config.evidence, other);
}

}  // namespace dynains::detail
