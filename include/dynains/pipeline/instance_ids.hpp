// Propagation of instance ids from scan to scan.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/clusters/cluster_set.hpp"
#include "dynains/points.hpp"

namespace dynains::detail {

/// Propagates the instance ids of the previous scan to the clusters of the current window.
class InstanceIds {
 public:
  using PointRuns = Span<const ClusterSet::PointRun>;

  /// Restarts the numbering of ids.
  void clear() { last_id_ = kNoInstance; }

  /// Fills `ids` with the instance id of each cluster of this window. `old_runs` and `point_runs`:
  /// point runs of the previous scan, with its old clusters (indices into `old_ids`) and with the
  /// clusters of this window. A cluster inherits the id of more than half of its points in the
  /// previous scan; without a majority, it inherits the id of some of them. If two clusters have
  /// one predecessor, the cluster with the lower index inherits the id and the other gets a new
  /// one.
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

  /// Fills `ids` by cluster. `predecessors`: by cluster, its old cluster (index into `old_ids`) or
  /// kNoCluster, which gives a new id.
  void propagate(Span<const std::uint32_t> predecessors, Span<const std::uint32_t> old_ids,
                 std::vector<std::uint32_t>& ids) {
    is_inherited_.assign(old_ids.size(), 0);
    ids.resize(predecessors.size());
    for (std::size_t c = 0; c < predecessors.size(); ++c) {
      const std::uint32_t old = predecessors[c];
      if (old != kNoCluster && is_inherited_[old] == 0) {
        is_inherited_[old] = 1;
        ids[c] = old_ids[old];
      } else {
        if (++last_id_ == kNoInstance) ++last_id_;  // skipped after an overflow
        ids[c] = last_id_;
      }
    }
  }

 private:
  // Majority vote of Boyer and Moore, with one candidate and one counter per cluster.
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
  std::vector<std::uint8_t> is_inherited_;
};

}  // namespace dynains::detail
