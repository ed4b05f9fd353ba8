// Conversion of verdicts on groups and points to the arrays of a ScanVerdict (Eq. 2). The cause
// determines the label and the keep flag.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/pipeline/scan_ring.hpp"
#include "dynains/points.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

/// Holds the verdict on one scan, by input point. One writer serves all scans in turn, so that open
/// scans need no arrays of their own.
class VerdictWriter {
 public:
  /// Keep flags of the last write_flags(), by point of the split (ground first): 1 if static.
  Span<const std::uint8_t> is_kept() const { return is_kept_; }

  /// Writes the verdict on a scan, which is valid until the next call.
  ScanVerdict write(const ScanSlot& scan, const EvidenceVerdict& evidence) {
    const std::size_t count = scan.input.size();
    const Group ground({Cause::kGround, 0.0F});
    assign(labels_, count, ground.label);
    assign(causes_, count, ground.cause);
    assign(beliefs_, count, ground.belief);
    assign(instances_, count, ground.instance);
    groups_.assign(evidence.groups.begin(), evidence.groups.end());
    for (std::size_t i = 0; i < evidence.cluster_of.size(); ++i) {
      const std::uint32_t cluster = evidence.cluster_of[i];
      if (cluster != kNoCluster) groups_[1 + i].instance = scan.ids[cluster];
    }
    scan.input.copy_to(input_);
    const std::uint32_t* const input = input_.data();
    const std::uint32_t* const group_of = evidence.group_of.data();
    const Group* const groups = groups_.data();
    // With the addresses of the arrays: a store of a byte could alias members.
    const auto write_to = [labels = labels_.data(), causes = causes_.data(),
                           beliefs = beliefs_.data(),
                           instances = instances_.data()](std::size_t i, const Group& group) {
      beliefs[i] = group.belief;
      instances[i] = group.instance;
      causes[i] = group.cause;
      labels[i] = group.label;
    };
    for (std::size_t i = 0; i < evidence.group_of.size(); ++i) {
      write_to(input[scan.split.ground_count + i], groups[group_of[i]]);
    }
    for (const EvidenceVerdict::GroundPoint& point : evidence.ground) {
      write_to(input[point.point], point.verdict);
    }
    Group unjudged;
    for (std::size_t i = scan.split.count; i < count; ++i) {
      unjudged.label = i < scan.valid ? PointLabel::kOutOfRange : PointLabel::kInvalid;
      write_to(input[i], unjudged);
    }
    return {scan.scan, scan.time, scan.T_world_sensor, labels_, instances_,
            beliefs_,  causes_,   scan.compared};
  }

  /// Writes the keep flags of the verdict of the last write().
  void write_flags(const ScanSlot& scan, const EvidenceVerdict& evidence) {
    is_kept_.assign(scan.split.count, 1);
    const std::uint32_t* const group_of = evidence.group_of.data();
    const Group* const groups = groups_.data();
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

  template <class T>
  static void assign(std::vector<T>& values, std::size_t count, T value) {
    ensure_capacity(values, count);
    values.assign(count, value);
  }

  // By input point.
  std::vector<PointLabel> labels_;
  std::vector<std::uint32_t> instances_;
  std::vector<float> beliefs_;
  std::vector<Cause> causes_;

  std::vector<std::uint8_t> is_kept_;  // by point of the split
  std::vector<std::uint32_t> input_;   // by point of the split
  std::vector<Group> groups_;          // of the evidence
};

}  // namespace dynains::detail
