// Votes of windows on the points of a scan.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/clusters/cluster_set.hpp"
#include "dynains/points.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

/// Step of the decision by windows that determined the verdict on a cluster (Eq. 11-19), in order.
enum class DecisionStage : std::uint8_t {
  kNoCluster,    ///< the point belongs to no cluster
  kTooFewScans,  ///< the cluster has no points in the oldest or in the newest scan
  kSimilar,      ///< similarity not below tau_s (Eq. 12)
  kProposed,     ///< proposed as dynamic; belief and votes decide
};

/// Verdict of one window on a cluster, or the sum of the verdicts of all windows so far on a point.
struct WindowVerdict {
  float belief = 0.0F;     ///< proposed clusters: highest posterior of all windows
  std::uint8_t votes = 0;  ///< proposed clusters: number of windows with verdict dynamic
  DecisionStage stage = DecisionStage::kNoCluster;  ///< latest stage reached in any window

  void add(const WindowVerdict& other) {
    belief = std::max(belief, other.belief);
    votes = static_cast<std::uint8_t>(votes + other.votes);
    stage = std::max(stage, other.stage);
  }
  friend bool operator==(const WindowVerdict& a, const WindowVerdict& b) {
    return a.belief == b.belief && a.votes == b.votes && a.stage == b.stage;
  }
};

/// Calls `visit(begin, end, a, b)` for the parts into which two lists of runs cut the same points.
template <class Runs, class Others, class Visitor>
void for_each_common_run(const Runs& runs, const Others& others, Visitor&& visit) {
  std::uint32_t begin = 0;
  auto other = others.begin();
  for (const auto& run : runs) {
    while (begin < run.end) {
      const std::uint32_t end = std::min(run.end, other->end);
      visit(begin, end, run, *other);
      begin = end;
      if (other->end == end) ++other;
    }
  }
}

/// Accumulated verdicts of all windows so far on the non-ground points of one scan, in the order of
/// its split. Neighbours mostly share them.
struct WindowVotes {
  /// The points from the end of the run before on.
  struct Run {
    std::uint32_t end;
    WindowVerdict verdict;
  };
  std::vector<Run> runs;
  std::vector<ClusterSet::PointRun> point_runs;  ///< in the window that ends with the scan

  /// Begins with no votes, for a scan with these point runs.
  void begin(Span<const ClusterSet::PointRun> of_scan) {
    ensure_capacity(point_runs, of_scan.size());
    point_runs.assign(of_scan.begin(), of_scan.end());
    runs.clear();
    if (!of_scan.empty()) runs.push_back({point_runs.back().end, {}});
  }

  /// Adds the verdicts of one window, by cluster. `in_window`: point runs of the scan in that
  /// window. `merged`: working memory.
  void record(Span<const ClusterSet::PointRun> in_window, Span<const WindowVerdict> verdicts,
              std::vector<Run>& merged) {
    merged.clear();
    for_each_common_run(
        runs, in_window,
        [&](std::uint32_t, std::uint32_t end, const Run& run, const ClusterSet::PointRun& other) {
          WindowVerdict verdict = run.verdict;
          if (other.cluster != kNoCluster) verdict.add(verdicts[other.cluster]);
          if (!merged.empty() && merged.back().verdict == verdict) {
            merged.back().end = end;
          } else {
            merged.push_back({end, verdict});
          }
        });
    ensure_capacity(runs, merged.size());
    runs.assign(merged.begin(), merged.end());
  }
};

/// Verdict on a point: dynamic if it has at least `votes_needed` votes.
inline EvidenceVerdict::Group point_verdict(const WindowVerdict& windows, int votes_needed) {
  constexpr std::array<Cause, 4> kStatic = {Cause::kNotJudged, Cause::kTooFewScans, Cause::kSimilar,
                                            Cause::kReverted};
  const bool is_dynamic =
      windows.stage == DecisionStage::kProposed && windows.votes >= votes_needed;
  return {is_dynamic ? Cause::kProposed : kStatic[static_cast<std::size_t>(windows.stage)],
          windows.belief};
}

}  // namespace dynains::detail
