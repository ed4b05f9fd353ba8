// Instance ids that stay with an object from scan to scan.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/curved_voxel_clusterer.hpp"
#include "dynains/points.hpp"

namespace dynains::detail {

/// Hands the ids of the previous scan's clusters on to the clusters of the current window.
class InstanceIds {
 public:
  /// Fills `ids` with an id per cluster of this window. Each point of the previous scan gives its
  /// old cluster (`old_cluster`, an index into `old_ids`) and its cluster in this window
  /// (`cluster`). A cluster takes the id that most of its points had; if two clusters want the
  /// same id, the first keeps it and the other gets a new one.
  void assign(Span<const std::uint32_t> old_cluster, Span<const std::uint32_t> old_ids,
              Span<const std::uint32_t> cluster, std::size_t cluster_count,
              std::vector<std::uint32_t>& ids) {
    // Majority vote of Boyer and Moore: one candidate and one counter per cluster.
    candidate_.assign(cluster_count, kNoCluster);
    lead_.assign(cluster_count, 0);
    for (std::size_t i = 0; i < cluster.size(); ++i) {
      const std::uint32_t c = cluster[i];
      if (c == kNoCluster || old_cluster[i] == kNoCluster) continue;
      if (lead_[c] == 0) candidate_[c] = old_cluster[i];
      if (candidate_[c] == old_cluster[i]) {
        ++lead_[c];
      } else {
        --lead_[c];
      }
    }
    hand_on(candidate_, old_ids, ids);
  }

  /// The same where it is known already which old cluster each cluster was (kNoCluster: none).
  void hand_on(Span<const std::uint32_t> predecessors, Span<const std::uint32_t> old_ids,
               std::vector<std::uint32_t>& ids) {
    taken_.assign(old_ids.size(), 0);
    ids.resize(predecessors.size());
    for (std::size_t c = 0; c < predecessors.size(); ++c) {
      const std::uint32_t old = predecessors[c];
      if (old != kNoCluster && taken_[old] == 0) {
        taken_[old] = 1;
        ids[c] = old_ids[old];
      } else {
        ids[c] = ++last_id_;
      }
    }
  }

 private:
  std::uint32_t last_id_ = kNoInstance;
  std::vector<std::uint32_t> candidate_;
  std::vector<std::uint32_t> lead_;
  std::vector<std::uint8_t> taken_;
};

}  // namespace dynains::detail
