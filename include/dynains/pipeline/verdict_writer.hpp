// Conversion of verdicts on groups and points to the arrays of a ScanVerdict (Eq. 2). The cause
// determines the label and the keep flag.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/pipeline/scan_ring.hpp"
#include "dynains/points.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

/// Number of the group of points that have a label without evidence: of kGround and those before.
constexpr std::uint32_t fixed_group(PointLabel label) { return static_cast<std::uint32_t>(label); }

/// Holds the verdict on one scan, by input point, and writes it by group of points, because random
/// access to several arrays dominates the cost. One writer serves all scans in turn, so that
/// open scans need no arrays of their own.
class VerdictWriter {
 public:
  /// Keep flags of the last write_flags(), by point of the split (ground first): 1 if static.
  Span<const std::uint8_t> is_kept() const { return is_kept_; }

  /// Writes the verdict on a scan, which is valid until the next call.
  ScanVerdict write(const ScanSlot& scan, const EvidenceVerdict& evidence) {
    const std::size_t count = scan.input.size();
    resize_with_margin(labels_, count);
    resize_with_margin(beliefs_, count);
    resize_with_margin(causes_, count);
    ensure_capacity(group_of_input_, count);
    group_of_input_.assign(count, fixed_group(PointLabel::kGround));
    resize_with_margin(instances_, count);
    scan.input.copy_to(input_);
    const std::uint32_t* const input = input_.data() + scan.split.ground_count;
    groups_.resize(kFirstGroup);
    for (const PointLabel label : {PointLabel::kInvalid, PointLabel::kOutOfRange}) {
      groups_[fixed_group(label)].label = label;
    }
    groups_[fixed_group(PointLabel::kGround)] = Group({Cause::kGround, 0.0F});
    groups_.insert(groups_.end(), evidence.groups.begin(), evidence.groups.end());
    for (std::size_t i = 0; i < evidence.cluster_of.size(); ++i) {
      const std::uint32_t cluster = evidence.cluster_of[i];
      if (cluster != kNoCluster) groups_[kFirstGroup + 1 + i].instance = scan.ids[cluster];
    }
    // The group of each input point comes first, so that the arrays are written sequentially.
    std::uint32_t* const group_of = group_of_input_.data();
    for (std::size_t i = scan.split.count; i < count; ++i) {
      group_of[input_[i]] =
          fixed_group(i < scan.valid ? PointLabel::kOutOfRange : PointLabel::kInvalid);
    }
    for (std::size_t i = 0; i < evidence.group_of.size(); ++i) {
      group_of[input[i]] = kFirstGroup + evidence.group_of[i];
    }
    for (const EvidenceVerdict::GroundPoint& ground : evidence.ground) {
      group_of[input_[ground.point]] = static_cast<std::uint32_t>(groups_.size());
      groups_.emplace_back(ground.verdict);
    }
    expand_groups(count);
    return {scan.scan, scan.time, scan.T_world_sensor, labels_, instances_,
            beliefs_,  causes_,   scan.compared};
  }

  /// Writes the keep flags of the verdict of the last write().
  void write_flags(const ScanSlot& scan, const EvidenceVerdict& evidence) {
    is_kept_.assign(scan.split.count, 1);
    const std::uint32_t* const group_of = evidence.group_of.data();
    const Group* const groups = groups_.data() + kFirstGroup;
    std::uint8_t* const is_kept = is_kept_.data() + scan.split.ground_count;
    for (std::size_t i = 0; i < evidence.group_of.size(); ++i) {
      is_kept[i] = groups[group_of[i]].label == PointLabel::kDynamic ? 0 : 1;
    }
    for (const EvidenceVerdict::GroundPoint& ground : evidence.ground) is_kept_[ground.point] = 0;
  }

 private:
  // Verdict on the points of a group.
  struct Group {
    Group() = default;
    Group(const EvidenceVerdict::Group& verdict)
        : belief(verdict.belief),
          label(is_dynamic(verdict.cause)         ? PointLabel::kDynamic
                : verdict.cause == Cause::kGround ? PointLabel::kGround
                                                  : PointLabel::kStatic),
          cause(verdict.cause) {}
    float belief = 0.0F;
    std::uint32_t instance = kNoInstance;
    PointLabel label = PointLabel::kStatic;
    Cause cause = Cause::kNotJudged;
  };

  static constexpr std::uint32_t kFirstGroup = fixed_group(PointLabel::kGround) + 1;  // of evidence

  void expand_groups(std::size_t count) {
    // Local copies of members avoid reloads after byte stores, which could alias them.
    const std::uint32_t* const group_of = group_of_input_.data();
    const Group* const groups = groups_.data();
    PointLabel* const labels = labels_.data();
    Cause* const causes = causes_.data();
    float* const beliefs = beliefs_.data();
    std::uint32_t* const instances = instances_.data();
    for (std::size_t i = 0; i < count; ++i) {
      const Group group = groups[group_of[i]];
      beliefs[i] = group.belief;
      instances[i] = group.instance;
      causes[i] = group.cause;
      labels[i] = group.label;
    }
  }

  // By input point.
  std::vector<PointLabel> labels_;
  std::vector<std::uint32_t> instances_;
  std::vector<float> beliefs_;
  std::vector<Cause> causes_;
  std::vector<std::uint32_t> group_of_input_;

  std::vector<std::uint8_t> is_kept_;  // by point of the split
  std::vector<std::uint32_t> input_;   // by point of the split
  std::vector<Group> groups_;          // fixed groups, then the groups of the evidence
};

}  // namespace dynains::detail
