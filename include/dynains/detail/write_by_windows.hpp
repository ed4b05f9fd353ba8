// From verdicts of windows on clusters to the points of a scan.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "dynains/cause.hpp"
#include "dynains/cluster_set.hpp"
#include "dynains/detail/bits.hpp"
#include "dynains/detail/lanes.hpp"
#include "dynains/detail/scan_slot.hpp"
#include "dynains/points.hpp"

namespace dynains::detail {

/// What a window says of one cluster.
struct ClusterVerdict {
  float belief = 0.0F;
  std::uint8_t dynamic = 0;
  Reach reach = Reach::kNoCluster;
};

/// Of the cluster of a streak; points without a cluster never come far.
inline ClusterVerdict verdict_on(const ClusterSet::Streak& streak,
                                 Span<const ClusterVerdict> verdicts) {
  return streak.cluster != kNoCluster ? verdicts[streak.cluster] : ClusterVerdict();
}

/// Takes in what the window in which the scan is the newest says of it. Its streaks and ids are
/// known.
inline void record_first(ScanSlot& scan, Span<const ClusterVerdict> verdicts) {
  const std::size_t count = scan.non_ground_count();
  scan.votes.resize(count);
  scan.belief.resize(count);
  scan.reach.resize(count);
  for (const ClusterSet::Streak& streak : scan.streaks) {
    const std::size_t length = streak.end - streak.begin;
    const ClusterVerdict verdict = verdict_on(streak, verdicts);
    std::fill_n(scan.reach.data() + streak.begin, length, verdict.reach);
    if (verdict.reach != Reach::kProposed) continue;
    std::fill_n(scan.votes.data() + streak.begin, length, verdict.dynamic);
    std::fill_n(scan.belief.data() + streak.begin, length, verdict.belief);
  }
  scan.first_reach = scan.reach;
}

/// Takes in what a later window says of the scan, whose points are cut into other streaks there.
inline void record_again(ScanSlot& scan, Span<const ClusterSet::Streak> streaks,
                         Span<const ClusterVerdict> verdicts) {
  // Read once: the compiler cannot know that stores leave members alone.
  Reach* const reach = scan.reach.data();
  std::uint8_t* const votes = scan.votes.data();
  float* const belief = scan.belief.data();
  for (const ClusterSet::Streak& streak : streaks) {
    if (streak.cluster == kNoCluster) continue;
    const ClusterVerdict verdict = verdicts[streak.cluster];
    if (verdict.reach != Reach::kProposed) {
      raise(reach + streak.begin, streak.end - streak.begin, verdict.reach);
      continue;
    }
    for (std::size_t i = streak.begin; i < streak.end; ++i) {
      const bool first = reach[i] != Reach::kProposed;
      reach[i] = Reach::kProposed;
      votes[i] = static_cast<std::uint8_t>((first ? 0 : votes[i]) + verdict.dynamic);
      belief[i] = first ? verdict.belief : std::max(belief[i], verdict.belief);
    }
  }
}

/// What holds unless a later stage says something else: good points are labelled as ground.
inline void begin_verdict(ScanSlot& scan) {
  const std::size_t count = scan.labels.size();
  scan.instances.assign(count, kNoInstance);
  scan.beliefs.assign(count, 0.0F);
  scan.is_kept.assign(scan.split.count, 1);
  scan.causes.resize(count);
  const PointLabel* const labels = scan.labels.data();
  Cause* const causes = scan.causes.data();
  for (std::size_t i = 0; i < count; ++i) {
    causes[i] = labels[i] == PointLabel::kGround ? Cause::kGround : Cause::kNotJudged;
  }
}

/// The first verdict by windows, streak by streak.
inline void write_by_windows(ScanSlot& scan, Span<const ClusterVerdict> verdicts) {
  const std::size_t ground_count = scan.split.ground_count;
  const std::uint32_t* const input = scan.split.input.data() + ground_count;
  PointLabel* const labels = scan.labels.data();
  Cause* const causes = scan.causes.data();
  std::uint32_t* const instances = scan.instances.data();
  float* const beliefs = scan.beliefs.data();
  std::uint8_t* const is_kept = scan.is_kept.data() + ground_count;
  for (const ClusterSet::Streak& streak : scan.streaks) {
    const ClusterVerdict verdict = verdict_on(streak, verdicts);
    const bool dynamic = verdict.dynamic != 0;
    const PointLabel label = dynamic ? PointLabel::kDynamic : PointLabel::kStatic;
    const Cause cause = dynamic ? Cause::kProposed : cause_to_stay(verdict.reach);
    const std::uint32_t id = streak.cluster != kNoCluster ? scan.ids[streak.cluster] : kNoInstance;
    for (std::size_t i = streak.begin; i < streak.end; ++i) {
      labels[input[i]] = label;
      causes[input[i]] = cause;
      instances[input[i]] = id;
    }
    if (verdict.reach != Reach::kProposed) continue;
    for (std::size_t i = streak.begin; i < streak.end; ++i) {
      beliefs[input[i]] = verdict.belief;
      is_kept[i] = dynamic ? 0 : 1;
    }
  }
}

/// Of eight points from `i` on: whether some window believed in one or brought one farther than the
/// first one did.
inline bool any_news(const Reach* reach, const Reach* first_reach, std::size_t i) {
  static_assert(static_cast<unsigned>(Reach::kProposed) == 3, "the only one with both bits set");
  std::uint64_t now, before;
  std::memcpy(&now, reach + i, sizeof(now));
  std::memcpy(&before, first_reach + i, sizeof(before));
  return now != before || (now & now >> 1U & kInEachByte) != 0;
}

/// The final verdict by windows: dynamic is what at least `votes` of them said it is. Only points
/// that some window believed in or brought farther can have changed.
inline void rewrite_by_windows(ScanSlot& scan, int votes) {
  const std::size_t ground_count = scan.split.ground_count;
  const std::uint32_t* const input = scan.split.input.data() + ground_count;
  const Reach* const reach = scan.reach.data();
  const Reach* const first_reach = scan.first_reach.data();
  const std::uint8_t* const said = scan.votes.data();
  const float* const belief = scan.belief.data();
  std::uint8_t* const is_kept = scan.is_kept.data() + ground_count;
  PointLabel* const labels = scan.labels.data();
  Cause* const causes = scan.causes.data();
  float* const beliefs = scan.beliefs.data();
  const std::size_t count = scan.reach.size();
  for (std::size_t begin = 0; begin < count; begin += kLanes) {
    const std::size_t end = std::min(begin + kLanes, count);
    if (end - begin == kLanes && !any_news(reach, first_reach, begin)) continue;
    for (std::size_t i = begin; i < end; ++i) {
      if (reach[i] == first_reach[i] && reach[i] != Reach::kProposed) continue;
      const bool proposed = reach[i] == Reach::kProposed;
      const bool dynamic = proposed && said[i] >= votes;
      is_kept[i] = dynamic ? 0 : 1;
      labels[input[i]] = dynamic ? PointLabel::kDynamic : PointLabel::kStatic;
      causes[input[i]] = dynamic ? Cause::kProposed : cause_to_stay(reach[i]);
      if (proposed) beliefs[input[i]] = belief[i];
    }
  }
}

}  // namespace dynains::detail
