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
};

/// Accumulated verdicts of all windows so far.
struct WindowVotes {
  std::vector<WindowVerdict> points;  ///< by non-ground point of one scan in the order of its split
  std::vector<ClusterSet::PointRun> point_runs;  ///< in the window that ends with the scan

  /// Adds the verdicts of one window, by cluster. `runs`: point runs of the scan in that window.
  void record(Span<const ClusterSet::PointRun> runs, Span<const WindowVerdict> verdicts) {
    for (const ClusterSet::PointRun& run : runs) {
      if (run.cluster == kNoCluster) continue;
      for (std::size_t i = run.begin; i < run.end; ++i) points[i].add(verdicts[run.cluster]);
    }
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
