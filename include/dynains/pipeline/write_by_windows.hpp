// From verdicts of windows on clusters to the points of a scan.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "dynains/cause.hpp"
#include "dynains/pipeline/scan_slot.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/bits.hpp"
#include "dynains/simd/capacity.hpp"
#include "dynains/simd/lanes.hpp"
#include "dynains/stage/cluster_set.hpp"

namespace dynains::detail {

/// What a window says of one cluster.
struct ClusterVerdict {
  float belief = 0.0F;
  std::uint8_t dynamic = 0;
  Reach reach = Reach::kNoCluster;
};

/// Of the cluster of a point_run; points without a cluster never come far.
inline ClusterVerdict verdict_on(const ClusterSet::PointRun& point_run,
                                 Span<const ClusterVerdict> verdicts) {
  return point_run.cluster != kNoCluster ? verdicts[point_run.cluster] : ClusterVerdict();
}

/// Points that are written at once.
inline constexpr std::size_t kReachPiece = 16;

/// Writes to each point how far the cluster of its point_run came, and to some more behind the last
/// one. Most point_runs are short: they are written in pieces that reach over the next one, which
/// takes back what is its own, so that the processor need not foretell lengths.
inline void spread_reach(Span<const ClusterSet::PointRun> point_runs,
                         Span<const ClusterVerdict> verdicts, Reach* reach) {
  for (const ClusterSet::PointRun& point_run : point_runs) {
    std::array<Reach, kReachPiece> piece;
    piece.fill(verdict_on(point_run, verdicts).reach);
    for (std::size_t i = point_run.begin; i < point_run.end; i += kReachPiece) {
      std::memcpy(reach + i, piece.data(), sizeof(piece));
    }
  }
}

/// Each point has come as far as either says. Pieces are read and written as a whole.
inline void join_reach(const Reach* said, std::size_t count, Reach* reach) {
  for (std::size_t i = 0; i < count; i += kReachPiece) {
    for (std::size_t word = i; word < i + kReachPiece; word += sizeof(std::uint64_t)) {
      std::uint64_t a, b;
      std::memcpy(&a, reach + word, sizeof(a));
      std::memcpy(&b, said + word, sizeof(b));
      a |= b;
      std::memcpy(reach + word, &a, sizeof(a));
    }
  }
}

/// Takes in what the window in which the scan is the newest says of it. Its point_runs and ids are
/// known.
inline void record_first(ScanSlot& scan, Span<const ClusterVerdict> verdicts) {
  const std::size_t count = scan.non_ground_count();
  scan.votes.resize(count);
  scan.belief.resize(count);
  scan.reach.resize(count + kReachPiece);
  spread_reach(scan.point_runs, verdicts, scan.reach.data());
  scan.first_reach = scan.reach;
  for (const ClusterSet::PointRun& point_run : scan.point_runs) {
    const ClusterVerdict verdict = verdict_on(point_run, verdicts);
    if (verdict.reach != Reach::kProposed) continue;
    const std::size_t length = point_run.end - point_run.begin;
    std::fill_n(scan.votes.data() + point_run.begin, length, verdict.dynamic);
    std::fill_n(scan.belief.data() + point_run.begin, length, verdict.belief);
  }
}

/// Takes in what a later window says of the scan, whose points are cut into other point_runs there.
/// `said` is overwritten: by point_run, with nothing read back that was just written, and then
/// joined with what was known as a whole.
inline void record_again(ScanSlot& scan, Span<const ClusterSet::PointRun> point_runs,
                         Span<const ClusterVerdict> verdicts, std::vector<Reach>& said) {
  // Read once: the compiler cannot know that stores leave members alone.
  Reach* const reach = scan.reach.data();
  std::uint8_t* const votes = scan.votes.data();
  float* const belief = scan.belief.data();
  for (const ClusterSet::PointRun& point_run : point_runs) {
    const ClusterVerdict verdict = verdict_on(point_run, verdicts);
    if (verdict.reach != Reach::kProposed) continue;
    for (std::size_t i = point_run.begin; i < point_run.end; ++i) {
      const bool first = reach[i] != Reach::kProposed;
      votes[i] = static_cast<std::uint8_t>((first ? 0 : votes[i]) + verdict.dynamic);
      belief[i] = first ? verdict.belief : std::max(belief[i], verdict.belief);
    }
  }
  grow(said, scan.reach.size());
  spread_reach(point_runs, verdicts, said.data());
  join_reach(said.data(), scan.non_ground_count(), reach);
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

/// The first verdict by windows, point_run by point_run.
inline void write_by_windows(ScanSlot& scan, Span<const ClusterVerdict> verdicts) {
  const std::size_t ground_count = scan.split.ground_count;
  const std::uint32_t* const input = scan.split.input.data() + ground_count;
  PointLabel* const labels = scan.labels.data();
  Cause* const causes = scan.causes.data();
  std::uint32_t* const instances = scan.instances.data();
  float* const beliefs = scan.beliefs.data();
  std::uint8_t* const is_kept = scan.is_kept.data() + ground_count;
  for (const ClusterSet::PointRun& point_run : scan.point_runs) {
    const ClusterVerdict verdict = verdict_on(point_run, verdicts);
    const bool dynamic = verdict.dynamic != 0;
    const PointLabel label = dynamic ? PointLabel::kDynamic : PointLabel::kStatic;
    const Cause cause = dynamic ? Cause::kProposed : cause_to_stay(verdict.reach);
    const std::uint32_t id =
        point_run.cluster != kNoCluster ? scan.ids[point_run.cluster] : kNoInstance;
    for (std::size_t i = point_run.begin; i < point_run.end; ++i) {
      labels[input[i]] = label;
      causes[input[i]] = cause;
      instances[input[i]] = id;
    }
    if (verdict.reach != Reach::kProposed) continue;
    for (std::size_t i = point_run.begin; i < point_run.end; ++i) {
      beliefs[input[i]] = verdict.belief;
      is_kept[i] = dynamic ? 0 : 1;
    }
  }
}

/// Of eight points from `i` on: whether some window believed in one or brought one farther than the
/// first one did.
inline bool any_news(const Reach* reach, const Reach* first_reach, std::size_t i) {
  static_assert(static_cast<unsigned>(Reach::kProposed) == 7, "the only one with that bit");
  std::uint64_t now, before;
  std::memcpy(&now, reach + i, sizeof(now));
  std::memcpy(&before, first_reach + i, sizeof(before));
  return now != before || (now & kInEachByte << 2U) != 0;
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
  const std::size_t count = scan.non_ground_count();
  for (std::size_t begin = 0; begin < count; begin += kPackWidth) {
    const std::size_t end = std::min(begin + kPackWidth, count);
    if (end - begin == kPackWidth && !any_news(reach, first_reach, begin)) continue;
    for (std::size_t i = begin; i < end; ++i) {
      if (reach[i] != Reach::kProposed) {
        if (reach[i] != first_reach[i]) causes[input[i]] = cause_to_stay(reach[i]);
        continue;
      }
      const bool dynamic = said[i] >= votes;
      is_kept[i] = dynamic ? 0 : 1;
      labels[input[i]] = dynamic ? PointLabel::kDynamic : PointLabel::kStatic;
      causes[input[i]] = dynamic ? Cause::kProposed : Cause::kReverted;
      beliefs[input[i]] = belief[i];
    }
  }
}

}  // namespace dynains::detail
