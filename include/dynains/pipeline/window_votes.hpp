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

/// Cause and belief of the verdict on one point.
using PointVerdict = EvidenceVerdict::Group;

/// Step of the decision by windows that determined the verdict on a cluster (Eq. 11-19), in order.
enum class DecisionStage : std::uint8_t {
  kNoCluster,    ///< the point belongs to no cluster
  kTooFewScans,  ///< the cluster has no points in the oldest or in the newest scan
  kSimilar,      ///< similarity not below tau_s (Eq. 12)
  kProposed,     ///< proposed as dynamic; belief and votes decide
};

/// Accumulated verdicts of all windows so far, by non-ground point of one scan in the order of its
/// split.
struct WindowVotes {
  std::vector<DecisionStage> stage;  ///< latest stage reached in any window
  std::vector<std::uint8_t> votes;   ///< proposed points: number of windows with verdict dynamic
  std::vector<float> belief;         ///< proposed points: highest posterior of all windows
  std::vector<ClusterSet::PointRun> point_runs;  ///< in the window that ends with the scan

  /// Ensures capacity for the votes on the scan of `other`.
  void reserve_like(const WindowVotes& other) {
    ensure_capacity(stage, other.stage.size());
    ensure_capacity(votes, other.votes.size());
    ensure_capacity(belief, other.belief.size());
    ensure_capacity(point_runs, other.point_runs.size());
  }
};

/// Cause of a static verdict on a point whose cluster reached `stage`.
constexpr Cause static_cause(DecisionStage stage) {
  constexpr std::array<Cause, 4> kCauses = {Cause::kNotJudged, Cause::kTooFewScans, Cause::kSimilar,
                                            Cause::kReverted};
  return kCauses[static_cast<std::size_t>(stage)];
}

/// Verdict of one window on one cluster.
struct ClusterVerdict {
  float belief = 0.0F;
  std::uint8_t is_dynamic = 0;
  DecisionStage stage = DecisionStage::kNoCluster;
};

/// Verdict on non-ground point `i`: dynamic if it has at least `votes_needed` votes.
inline PointVerdict point_verdict(const WindowVotes& votes, std::size_t i, int votes_needed) {
  const DecisionStage stage = votes.stage[i];
  if (stage != DecisionStage::kProposed) return {static_cause(stage), 0.0F};
  return {votes.votes[i] >= votes_needed ? Cause::kProposed : Cause::kReverted, votes.belief[i]};
}

/// Verdict of the window on the cluster of a run.
inline ClusterVerdict verdict_on(const ClusterSet::PointRun& run,
                                 Span<const ClusterVerdict> verdicts) {
  return run.cluster != kNoCluster ? verdicts[run.cluster] : ClusterVerdict();
}

/// Records the window that ends with the scan of `point_count` points. `votes.point_runs` must be
/// set.
inline void record_first_window(std::size_t point_count, Span<const ClusterVerdict> verdicts,
                                WindowVotes& votes) {
  resize_with_margin(votes.votes, point_count);
  resize_with_margin(votes.belief, point_count);
  resize_with_margin(votes.stage, point_count);
  for (const ClusterSet::PointRun& run : votes.point_runs) {
    const ClusterVerdict verdict = verdict_on(run, verdicts);
    const std::size_t length = run.end - run.begin;
    std::fill_n(votes.stage.data() + run.begin, length, verdict.stage);
    std::fill_n(votes.votes.data() + run.begin, length, verdict.is_dynamic);
    std::fill_n(votes.belief.data() + run.begin, length, verdict.belief);
  }
}

/// Records a later window. `point_runs`: point runs of the scan in that window.
inline void record_later_window(Span<const ClusterSet::PointRun> point_runs,
                                Span<const ClusterVerdict> verdicts, WindowVotes& votes) {
  for (const ClusterSet::PointRun& run : point_runs) {
    const ClusterVerdict verdict = verdict_on(run, verdicts);
    for (std::size_t i = run.begin; i < run.end; ++i) {
      if (verdict.stage == DecisionStage::kProposed) {
        const bool is_first = votes.stage[i] != DecisionStage::kProposed;
        votes.votes[i] =
            static_cast<std::uint8_t>((is_first ? 0 : votes.votes[i]) + verdict.is_dynamic);
        votes.belief[i] = is_first ? verdict.belief : std::max(votes.belief[i], verdict.belief);
      }
      votes.stage[i] = std::max(votes.stage[i], verdict.stage);
    }
  }
}

}  // namespace dynains::detail
