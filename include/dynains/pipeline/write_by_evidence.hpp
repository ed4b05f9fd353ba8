// From the evidence of other scans to the points of a scan.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/cause.hpp"
#include "dynains/curved_voxel_clusterer.hpp"
#include "dynains/pipeline/scan_slot.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/capacity.hpp"
#include "dynains/stage/evidence_verdict.hpp"

namespace dynains::detail {

/// What the points of a group get.
struct GroupVerdict {
  float belief;
  PointLabel label;
  Cause cause;
  std::uint8_t is_kept;
  std::uint8_t is_news;  // not what was said of it before
};

inline constexpr GroupVerdict kStaysGround = {0.0F, PointLabel::kGround, Cause::kGround, 1, 1};

inline GroupVerdict verdict_of(EvidenceVerdict::Group group, bool is_news) {
  const bool dynamic = is_dynamic(group.cause);
  return {group.belief, dynamic ? PointLabel::kDynamic : PointLabel::kStatic, group.cause,
          static_cast<std::uint8_t>(dynamic ? 0 : 1), static_cast<std::uint8_t>(is_news ? 1 : 0)};
}

/// The same of a point in which some window believed: at least `votes` of them have to.
inline GroupVerdict with_windows(const ScanSlot& scan, std::size_t point, int votes,
                                 const GroupVerdict& verdict) {
  const bool voted = scan.votes[point] >= votes && verdict.is_kept != 0;
  return verdict_of(
      {voted ? Cause::kProposed : verdict.cause, std::max(scan.belief[point], verdict.belief)},
      true);
}

/// Of one input point.
inline void write_one(ScanSlot& scan, std::uint32_t input, const GroupVerdict& verdict) {
  scan.labels[input] = verdict.label;
  scan.causes[input] = verdict.cause;
  scan.beliefs[input] = verdict.belief;
}

/// Room for verdicts by group, which are numbered behind two groups that never change.
struct VerdictScratch {
  static constexpr std::uint32_t kOutside = 0;  // no part of the split
  static constexpr std::uint32_t kGround = 1;
  static constexpr std::uint32_t kFirst = 2;

  std::vector<std::uint32_t> group_of;  // by input point
  std::vector<GroupVerdict> verdicts;   // by group
};

/// Each point above the ground gets the instance of its cluster.
inline void write_instances(ScanSlot& scan, Span<const std::uint32_t> cluster_of) {
  scan.instances.assign(scan.labels.size(), kNoInstance);
  const std::uint32_t* const input = scan.split.input.data() + scan.split.ground_count;
  const std::uint32_t* const clusters = cluster_of.data();
  const std::uint32_t* const ids = scan.ids.data();
  std::uint32_t* const instances = scan.instances.data();
  const std::size_t count = cluster_of.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (clusters[i] != kNoCluster) instances[input[i]] = ids[clusters[i]];
  }
}

/// The groups of all points, in the order of the input. Good points are labelled as ground.
inline void order_groups(const ScanSlot& scan, Span<const std::uint32_t> groups,
                         std::vector<std::uint32_t>& ordered) {
  const std::size_t count = scan.labels.size();
  grow(ordered, count);
  std::uint32_t* const group_of = ordered.data();
  const PointLabel* const labels = scan.labels.data();
  for (std::size_t i = 0; i < count; ++i) {
    group_of[i] =
        labels[i] == PointLabel::kGround ? VerdictScratch::kGround : VerdictScratch::kOutside;
  }
  const std::uint32_t* const input = scan.split.input.data() + scan.split.ground_count;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    group_of[input[i]] = VerdictScratch::kFirst + groups[i];
  }
}

/// Points of the ground that moved, and those of which that was said before but is not any more.
inline void write_ground(ScanSlot& scan, Span<const EvidenceVerdict::GroundPoint> moved) {
  const auto write = [&scan](std::uint32_t point, const GroupVerdict& verdict) {
    scan.is_kept[point] = verdict.is_kept;
    write_one(scan, scan.split.input[point], verdict);
  };
  for (const std::uint32_t point : scan.moved_ground) write(point, kStaysGround);
  scan.moved_ground.clear();
  ensure_capacity(scan.moved_ground, moved.size());
  for (const EvidenceVerdict::GroundPoint& ground : moved) {
    write(ground.point, {ground.verdict.belief, PointLabel::kDynamic, ground.verdict.cause, 0, 1});
    scan.moved_ground.push_back(ground.point);
  }
}

/// The first verdict by the evidence of other scans, and by windows where `compared`. What is kept
/// is told by the last one alone. Groups are brought into the order of the input first, so that
/// verdicts are written from front to back: some arrays at once by random access cost more.
inline void write_by_evidence(ScanSlot& scan, const EvidenceVerdict& said, bool compared,
                              VerdictScratch& scratch) {
  order_groups(scan, said.group_of, scratch.group_of);
  scratch.verdicts.resize(VerdictScratch::kFirst + said.groups.size());
  scratch.verdicts[VerdictScratch::kOutside] = verdict_of({Cause::kNotJudged, 0.0F}, true);
  scratch.verdicts[VerdictScratch::kGround] = kStaysGround;
  for (std::size_t g = 0; g < said.groups.size(); ++g) {
    scratch.verdicts[VerdictScratch::kFirst + g] = verdict_of(said.groups[g], true);
  }
  ensure_capacity(scan.proof, said.groups.size());
  scan.proof.assign(said.groups.begin(), said.groups.end());

  const std::size_t count = scan.labels.size();
  scan.beliefs.resize(count);
  scan.causes.resize(count);
  scan.is_kept.resize(scan.split.count);
  scan.moved_ground.clear();
  // Read once: stores of bytes may change anything, as far as the compiler knows.
  const std::uint32_t* const group_of = scratch.group_of.data();
  const GroupVerdict* const verdicts = scratch.verdicts.data();
  PointLabel* const labels = scan.labels.data();
  Cause* const causes = scan.causes.data();
  float* const beliefs = scan.beliefs.data();
  for (std::size_t i = 0; i < count; ++i) {
    const GroupVerdict verdict = verdicts[group_of[i]];
    beliefs[i] = verdict.belief;
    causes[i] = verdict.cause;
    // What is outside has its label already.
    labels[i] = group_of[i] == VerdictScratch::kOutside ? labels[i] : verdict.label;
  }
  write_ground(scan, said.ground);
  if (!compared) return;
  const std::uint32_t* const input = scan.split.input.data() + scan.split.ground_count;
  for (std::size_t i = 0; i < said.group_of.size(); ++i) {
    if (scan.reach[i] != Reach::kProposed) continue;
    write_one(scan, input[i], with_windows(scan, i, 1, verdicts[group_of[input[i]]]));
  }
}

/// A later verdict, of which only news are written, and by windows where `compared`.
inline void rewrite_by_evidence(ScanSlot& scan, const EvidenceVerdict& said, bool compared,
                                int votes, VerdictScratch& scratch) {
  std::fill_n(scan.is_kept.begin(), scan.split.ground_count, std::uint8_t{1});
  write_ground(scan, said.ground);
  scratch.verdicts.resize(said.groups.size());
  for (std::size_t g = 0; g < said.groups.size(); ++g) {
    scratch.verdicts[g] = verdict_of(said.groups[g], !(said.groups[g] == scan.proof[g]));
  }
  scan.proof.assign(said.groups.begin(), said.groups.end());

  const std::size_t ground_count = scan.split.ground_count;
  const std::size_t count = scan.non_ground_count();
  const std::uint32_t* const input = scan.split.input.data() + ground_count;
  const std::uint32_t* const group_of = said.group_of.data();
  const GroupVerdict* const verdicts = scratch.verdicts.data();
  std::uint8_t* const is_kept = scan.is_kept.data() + ground_count;
  PointLabel* const labels = scan.labels.data();
  Cause* const causes = scan.causes.data();
  float* const beliefs = scan.beliefs.data();
  for (std::size_t i = 0; i < count; ++i) {
    GroupVerdict verdict = verdicts[group_of[i]];
    if (compared && scan.reach[i] == Reach::kProposed) {
      verdict = with_windows(scan, i, votes, verdict);
    }
    is_kept[i] = verdict.is_kept;
    if (verdict.is_news == 0) continue;
    const std::uint32_t to = input[i];
    labels[to] = verdict.label;
    causes[to] = verdict.cause;
    beliefs[to] = verdict.belief;
  }
}

}  // namespace dynains::detail
