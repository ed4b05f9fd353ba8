// Conversion of verdicts on clusters, groups and points to the arrays of a ScanVerdict (Eq. 2). The
// cause determines the label and the keep flag.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/curved_voxel_clusterer.hpp"
#include "dynains/pipeline/scan_ring.hpp"
#include "dynains/pipeline/window_votes.hpp"
#include "dynains/points.hpp"
#include "dynains/stage/cluster_set.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

/// Label of a valid point for the cause of its verdict.
constexpr PointLabel label_of(Cause cause) {
  if (is_dynamic(cause)) return PointLabel::kDynamic;
  return cause == Cause::kGround ? PointLabel::kGround : PointLabel::kStatic;
}

/// Writes verdicts into the arrays of scans. Points with a common verdict are written by point run
/// or by group, because random access to several arrays dominates the cost.
class VerdictWriter {
 public:
  /// Keep flags of the last final verdict, by point of the split (ground first): 1 if static.
  Span<const std::uint8_t> is_kept() const { return is_kept_; }

  /// Begins the first verdict on a scan: writes instance ids and the verdicts on ground and invalid
  /// points. All valid points must have the label kGround. `cluster_of`: by non-ground point.
  void begin(ScanSlot& scan, Span<const std::uint32_t> cluster_of) {
    const std::size_t count = scan.labels.size();
    is_kept_.resize(scan.split.count);
    scan.moved_ground.clear();
    scan.beliefs.assign(count, 0.0F);
    scan.causes.resize(count);
    const PointLabel* const labels = scan.labels.data();
    Cause* const causes = scan.causes.data();
    for (std::size_t i = 0; i < count; ++i) {
      causes[i] = labels[i] == PointLabel::kGround ? Cause::kGround : Cause::kNotJudged;
    }
    scan.instances.assign(count, kNoInstance);
    const std::uint32_t* const input = scan.non_ground_input();
    const std::uint32_t* const clusters = cluster_of.data();
    const std::uint32_t* const ids = scan.ids.data();
    std::uint32_t* const instances = scan.instances.data();
    const std::size_t non_ground_count = cluster_of.size();
    for (std::size_t i = 0; i < non_ground_count; ++i) {
      if (clusters[i] != kNoCluster) instances[input[i]] = ids[clusters[i]];
    }
  }

  /// Writes the first verdict on the non-ground points, by point run. `verdict_of(cluster)` returns
  /// a PointVerdict.
  template <class VerdictOf>
  void write_runs(ScanSlot& scan, Span<const ClusterSet::PointRun> point_runs,
                  VerdictOf&& verdict_of) {
    const std::uint32_t* const input = scan.non_ground_input();
    PointLabel* const labels = scan.labels.data();
    Cause* const causes = scan.causes.data();
    float* const beliefs = scan.beliefs.data();
    for (const ClusterSet::PointRun& run : point_runs) {
      const PointVerdict verdict = verdict_of(run.cluster);
      const PointLabel label = label_of(verdict.cause);
      for (std::size_t i = run.begin; i < run.end; ++i) {
        labels[input[i]] = label;
        causes[input[i]] = verdict.cause;
      }
      if (verdict.belief == 0.0F) continue;
      for (std::size_t i = run.begin; i < run.end; ++i) beliefs[input[i]] = verdict.belief;
    }
  }

  /// Writes the first verdict by group. The group of each input point is computed first, so that
  /// the arrays are written sequentially.
  void write_groups(ScanSlot& scan, const EvidenceVerdict& evidence) {
    order_groups(scan, evidence.group_of);
    verdicts_.resize(kFirstGroup + evidence.groups.size());
    verdicts_[kBadPoints] = {{Cause::kNotJudged, 0.0F}, true};
    verdicts_[kGroundPoints] = {{Cause::kGround, 0.0F}, true};
    for (std::size_t g = 0; g < evidence.groups.size(); ++g) {
      verdicts_[kFirstGroup + g] = {evidence.groups[g], true};
    }
    ensure_capacity(scan.written_groups, evidence.groups.size());
    scan.written_groups.assign(evidence.groups.begin(), evidence.groups.end());

    // Local copies of members avoid reloads after byte stores, which could alias them.
    const std::size_t count = scan.labels.size();
    const std::uint32_t* const group_of = group_of_input_.data();
    const GroupVerdict* const verdicts = verdicts_.data();
    PointLabel* const labels = scan.labels.data();
    Cause* const causes = scan.causes.data();
    float* const beliefs = scan.beliefs.data();
    for (std::size_t i = 0; i < count; ++i) {
      const GroupVerdict verdict = verdicts[group_of[i]];
      beliefs[i] = verdict.belief;
      causes[i] = verdict.cause;
      labels[i] = group_of[i] == kBadPoints ? labels[i] : verdict.label;
    }
    write_ground(scan, evidence.ground);
  }

  /// Begins the final verdict on a scan: sets all keep flags.
  void begin_final(const ScanSlot& scan) { is_kept_.assign(scan.split.count, 1); }

  /// Writes the final verdict by group. Only changed verdicts are written to the arrays of the
  /// scan.
  void rewrite_groups(ScanSlot& scan, const EvidenceVerdict& evidence) {
    write_ground(scan, evidence.ground);
    verdicts_.resize(evidence.groups.size());
    for (std::size_t g = 0; g < evidence.groups.size(); ++g) {
      verdicts_[g] = {evidence.groups[g], !(evidence.groups[g] == scan.written_groups[g])};
    }
    scan.written_groups.assign(evidence.groups.begin(), evidence.groups.end());

    const std::size_t count = scan.non_ground_count();
    const std::uint32_t* const input = scan.non_ground_input();
    const std::uint32_t* const group_of = evidence.group_of.data();
    const GroupVerdict* const verdicts = verdicts_.data();
    std::uint8_t* const is_kept = is_kept_.data() + scan.split.ground_count;
    PointLabel* const labels = scan.labels.data();
    Cause* const causes = scan.causes.data();
    float* const beliefs = scan.beliefs.data();
    for (std::size_t i = 0; i < count; ++i) {
      const GroupVerdict verdict = verdicts[group_of[i]];
      is_kept[i] = verdict.is_kept;
      if (verdict.is_changed == 0) continue;
      const std::uint32_t to = input[i];
      labels[to] = verdict.label;
      causes[to] = verdict.cause;
      beliefs[to] = verdict.belief;
    }
  }

  /// Writes verdicts on single points, by index in the split.
  class Points {
   public:
    void write(std::size_t point, const PointVerdict& verdict) const {
      const std::uint32_t to = input_[point];
      labels_[to] = label_of(verdict.cause);
      causes_[to] = verdict.cause;
      beliefs_[to] = verdict.belief;
      is_kept_[point] = is_dynamic(verdict.cause) ? 0 : 1;
    }

   private:
    friend class VerdictWriter;
    Points(ScanSlot& scan, std::vector<std::uint8_t>& is_kept)
        : input_(scan.split.input.data()),
          labels_(scan.labels.data()),
          causes_(scan.causes.data()),
          beliefs_(scan.beliefs.data()),
          is_kept_(is_kept.data()) {}

    const std::uint32_t* input_;
    PointLabel* labels_;
    Cause* causes_;
    float* beliefs_;
    std::uint8_t* is_kept_;
  };
  Points points(ScanSlot& scan) { return {scan, is_kept_}; }

 private:
  // Verdict on the points of a group, packed in eight bytes.
  struct GroupVerdict {
    GroupVerdict() = default;
    GroupVerdict(const PointVerdict& verdict, bool changed)
        : belief(verdict.belief),
          label(label_of(verdict.cause)),
          cause(verdict.cause),
          is_kept(is_dynamic(verdict.cause) ? 0 : 1),
          is_changed(changed ? 1 : 0) {}
    float belief = 0.0F;
    PointLabel label = PointLabel::kStatic;
    Cause cause = Cause::kNotJudged;
    std::uint8_t is_kept = 1;
    std::uint8_t is_changed = 1;  // differs from the verdict written before
  };
  // Group numbers in group_of_input_: two with fixed verdicts, then the groups of the evidence.
  static constexpr std::uint32_t kBadPoints = 0;
  static constexpr std::uint32_t kGroundPoints = 1;
  static constexpr std::uint32_t kFirstGroup = 2;

  void order_groups(const ScanSlot& scan, Span<const std::uint32_t> groups) {
    const std::size_t count = scan.labels.size();
    grow(group_of_input_, count);
    std::uint32_t* const group_of = group_of_input_.data();
    const PointLabel* const labels = scan.labels.data();
    for (std::size_t i = 0; i < count; ++i) {
      group_of[i] = labels[i] == PointLabel::kGround ? kGroundPoints : kBadPoints;
    }
    const std::uint32_t* const input = scan.non_ground_input();
    for (std::size_t i = 0; i < groups.size(); ++i) group_of[input[i]] = kFirstGroup + groups[i];
  }

  // Resets the ground points that an earlier verdict classified as dynamic, then writes `moved`.
  void write_ground(ScanSlot& scan, Span<const EvidenceVerdict::GroundPoint> moved) {
    const Points points = this->points(scan);
    for (const std::uint32_t point : scan.moved_ground) points.write(point, {Cause::kGround, 0.0F});
    scan.moved_ground.clear();
    ensure_capacity(scan.moved_ground, moved.size());
    for (const EvidenceVerdict::GroundPoint& ground : moved) {
      points.write(ground.point, ground.verdict);
      scan.moved_ground.push_back(ground.point);
    }
  }

  std::vector<std::uint8_t> is_kept_;          // by point of the split
  std::vector<std::uint32_t> group_of_input_;  // by input point
  std::vector<GroupVerdict> verdicts_;
};

}  // namespace dynains::detail
