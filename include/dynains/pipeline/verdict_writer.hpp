// Conversion of verdicts on clusters, groups and points to the arrays of a ScanVerdict (Eq. 2). The
// cause determines the label and the keep flag.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/pipeline/scan_ring.hpp"
#include "dynains/pipeline/window_votes.hpp"
#include "dynains/points.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

/// Label of a valid point for the cause of its verdict.
constexpr PointLabel label_of(Cause cause) {
  if (is_dynamic(cause)) return PointLabel::kDynamic;
  return cause == Cause::kGround ? PointLabel::kGround : PointLabel::kStatic;
}

/// Number of the group of points that have a label without evidence: of kGround and those before.
constexpr std::uint32_t fixed_group(PointLabel label) { return static_cast<std::uint32_t>(label); }

/// Holds the verdict on one scan, by input point, and writes it by group of points, because random
/// access to several arrays dominates the cost. One writer serves all scans in turn, so that
/// open scans need no arrays of their own.
class VerdictWriter {
 public:
  /// The written verdict on `scan`, valid until the next begin().
  ScanVerdict verdict(const ScanSlot& scan) const {
    return {scan.scan, scan.time, scan.T_world_sensor, labels_, instances_, beliefs_, causes_};
  }
  /// Keep flags of the verdict, by point of the split (ground first): 1 if static.
  Span<const std::uint8_t> is_kept() const { return is_kept_; }

  /// Ensures capacity for a scan of `points` points and writes to the memory, so that later scans
  /// cause no page faults.
  void touch(std::size_t points) {
    resize_all(points, labels_, instances_, beliefs_, causes_, is_kept_, group_of_input_, input_,
               cluster_of_);
  }

  /// Ensures capacity for the number of groups of `other`.
  void ensure_capacity_like(const VerdictWriter& other) {
    ensure_capacity(verdicts_, other.verdicts_.size());
  }

  /// Begins the verdict on a scan: writes the instance ids, and sets all keep flags.
  void begin(const ScanSlot& scan) {
    const std::size_t count = scan.unjudged.size();
    is_kept_.assign(scan.split.count, 1);
    ensure_capacity(instances_, count);
    instances_.assign(count, kNoInstance);
    scan.input.copy_to(input_);
    scan.cluster_of.copy_to(cluster_of_);
    const std::uint32_t* const input = input_.data() + scan.split.ground_count;
    std::uint32_t* const instances = instances_.data();
    for (std::size_t i = 0; i < cluster_of_.size(); ++i) {
      if (cluster_of_[i] != kNoCluster) instances[input[i]] = scan.ids[cluster_of_[i]];
    }
    resize_all(count, labels_, beliefs_, causes_);
  }

  /// Writes the verdict of the windows so far on all points: dynamic with at least `votes_needed`
  /// votes. Also writes the keep flags.
  void write_windows(const ScanSlot& scan, int votes_needed) {
    write_ground(scan.unjudged);
    const std::size_t count = scan.non_ground_count();
    const std::uint32_t* const input = input_.data() + scan.split.ground_count;
    const DecisionStage* const stage = scan.windows.stage.data();
    PointLabel* const labels = labels_.data();
    Cause* const causes = causes_.data();
    for (std::size_t i = 0; i < count; ++i) {
      if (stage[i] == DecisionStage::kProposed) {
        write(scan.split.ground_count + i, point_verdict(scan.windows, i, votes_needed));
      } else {
        labels[input[i]] = PointLabel::kStatic;
        causes[input[i]] = static_cause(stage[i]);
      }
    }
  }

  /// Writes the verdict by evidence on all points. The group of each input point is computed first,
  /// so that the arrays are written sequentially.
  void write_groups(const ScanSlot& scan, const EvidenceVerdict& evidence) {
    verdicts_.resize(kFirstGroup);
    for (const PointLabel label : {PointLabel::kInvalid, PointLabel::kOutOfRange}) {
      verdicts_[fixed_group(label)].label = label;
    }
    verdicts_[fixed_group(PointLabel::kGround)] = GroupVerdict({Cause::kGround, 0.0F});
    verdicts_.insert(verdicts_.end(), evidence.groups.begin(), evidence.groups.end());
    order_groups(scan, evidence.group_of);
    expand_groups(scan.unjudged.size());
    for (const EvidenceVerdict::GroundPoint& ground : evidence.ground) {
      write(ground.point, ground.verdict);
    }
  }

  /// Writes the keep flags of the non-ground points after write_groups().
  void flag_groups(const ScanSlot& scan, const EvidenceVerdict& evidence) {
    const std::size_t count = scan.non_ground_count();
    const std::uint32_t* const group_of = evidence.group_of.data();
    const GroupVerdict* const verdicts = verdicts_.data() + kFirstGroup;
    std::uint8_t* const is_kept = is_kept_.data() + scan.split.ground_count;
    for (std::size_t i = 0; i < count; ++i) is_kept[i] = verdicts[group_of[i]].is_kept;
  }

 private:
  // Verdict on the points of a group, packed in eight bytes.
  struct GroupVerdict {
    GroupVerdict() = default;
    GroupVerdict(const PointVerdict& verdict)
        : belief(verdict.belief),
          label(label_of(verdict.cause)),
          cause(verdict.cause),
          is_kept(is_dynamic(verdict.cause) ? 0 : 1) {}
    float belief = 0.0F;
    PointLabel label = PointLabel::kStatic;
    Cause cause = Cause::kNotJudged;
    std::uint8_t is_kept = 1;
  };
  static constexpr std::uint32_t kFirstGroup = fixed_group(PointLabel::kGround) + 1;  // of evidence

  // Writes the verdict on a single point, by index in the split.
  void write(std::size_t point, const PointVerdict& verdict) {
    const std::uint32_t to = input_[point];
    labels_[to] = label_of(verdict.cause);
    causes_[to] = verdict.cause;
    beliefs_[to] = verdict.belief;
    is_kept_[point] = is_dynamic(verdict.cause) ? 0 : 1;
  }

  template <class... Vectors>
  static void resize_all(std::size_t count, Vectors&... values) {
    (resize_with_margin(values, count), ...);
  }

  // Writes the verdict on ground and on unjudged points; other points get that of the ground.
  void write_ground(Span<const PointLabel> unjudged) {
    std::fill(causes_.begin(), causes_.end(), Cause::kGround);
    std::copy(unjudged.begin(), unjudged.end(), labels_.begin());
    std::fill(beliefs_.begin(), beliefs_.end(), 0.0F);
    for (std::size_t i = 0; i < unjudged.size(); ++i) {
      if (unjudged[i] != PointLabel::kGround) causes_[i] = Cause::kNotJudged;
    }
  }

  void order_groups(const ScanSlot& scan, Span<const std::uint32_t> groups) {
    resize_with_margin(group_of_input_, scan.unjudged.size());
    std::uint32_t* const group_of = group_of_input_.data();
    std::transform(scan.unjudged.begin(), scan.unjudged.end(), group_of, fixed_group);
    const std::uint32_t* const input = input_.data() + scan.split.ground_count;
    for (std::size_t i = 0; i < groups.size(); ++i) group_of[input[i]] = kFirstGroup + groups[i];
  }

  void expand_groups(std::size_t count) {
    // Local copies of members avoid reloads after byte stores, which could alias them.
    const std::uint32_t* const group_of = group_of_input_.data();
    const GroupVerdict* const verdicts = verdicts_.data();
    PointLabel* const labels = labels_.data();
    Cause* const causes = causes_.data();
    float* const beliefs = beliefs_.data();
    for (std::size_t i = 0; i < count; ++i) {
      const GroupVerdict verdict = verdicts[group_of[i]];
      beliefs[i] = verdict.belief;
      causes[i] = verdict.cause;
      labels[i] = verdict.label;
    }
  }

  // By input point.
  std::vector<PointLabel> labels_;
  std::vector<std::uint32_t> instances_;
  std::vector<float> beliefs_;
  std::vector<Cause> causes_;
  std::vector<std::uint32_t> group_of_input_;

  std::vector<std::uint8_t> is_kept_;      // by point of the split
  std::vector<std::uint32_t> input_;       // by point of the split
  std::vector<std::uint32_t> cluster_of_;  // by non-ground point
  std::vector<GroupVerdict> verdicts_;
};

}  // namespace dynains::detail
