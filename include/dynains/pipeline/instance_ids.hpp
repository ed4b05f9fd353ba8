// Instance ids that follow an object from scan to scan.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/stage/cluster_set.hpp"

namespace dynains::detail {

/// Propagates the ids of clusters of the previous scan to those of the current window.
class InstanceIds {
 public:
  using PointRuns = Span<const ClusterSet::PointRun>;

  /// Starts with the first id again.
  void clear() { last_id_ = kNoInstance; }

  /// Fills `ids` with an id per cluster of this window. The points of the previous scan give their
  /// old clusters (`old_runs`, with indices into `old_ids`) and their clusters in this window
  /// (`point_runs`). A cluster takes the id that more than half of its points had, or without such
  /// a majority one of those that some had; if two clusters want the same id, the first keeps it
  /// and the other gets a new one.
  void assign(PointRuns old_runs, Span<const std::uint32_t> old_ids, PointRuns point_runs,
              std::size_t cluster_count, std::vector<std::uint32_t>& ids) {
    candidate_.assign(cluster_count, kNoCluster);
    lead_.assign(cluster_count, 0);
    const ClusterSet::PointRun* old = old_runs.begin();
    for (const ClusterSet::PointRun& point_run : point_runs) {
      std::uint32_t begin = point_run.begin;
      while (begin < point_run.end) {
        const std::uint32_t end = std::min(old->end, point_run.end);
        vote(point_run.cluster, old->cluster, end - begin);
        begin = end;
        if (old->end == end) ++old;
      }
    }
    propagate(candidate_, old_ids, ids);
  }

  /// Assigns ids by the given old cluster of each cluster, or kNoCluster.
  void propagate(Span<const std::uint32_t> predecessors, Span<const std::uint32_t> old_ids,
                 std::vector<std::uint32_t>& ids) {
    taken_.assign(old_ids.size(), 0);
    ids.resize(predecessors.size());
    for (std::size_t c = 0; c < predecessors.size(); ++c) {
      const std::uint32_t old = predecessors[c];
      if (old != kNoCluster && taken_[old] == 0) {
        taken_[old] = 1;
        ids[c] = old_ids[old];
      } else {
        if (++last_id_ == kNoInstance) ++last_id_;  // after an overflow
        ids[c] = last_id_;
      }
    }
  }

 private:
  // Majority vote of Boyer and Moore: one candidate and one counter per cluster.
  void vote(std::uint32_t cluster, std::uint32_t old_cluster, std::uint32_t points) {
    if (cluster == kNoCluster || old_cluster == kNoCluster) return;
    std::uint32_t& lead = lead_[cluster];
    if (candidate_[cluster] == old_cluster) {
      lead += points;
    } else if (points <= lead) {
      lead -= points;
    } else {
      candidate_[cluster] = old_cluster;
      lead = points - lead;
    }
  }

  std::uint32_t last_id_ = kNoInstance;
  std::vector<std::uint32_t> candidate_;
  std::vector<std::uint32_t> lead_;
  std::vector<std::uint8_t> taken_;
};

}  // namespace dynains::detail
