// The points of a window ordered by cluster and, within a cluster, by scan: the separation by
// time stamp of Eq. 4 becomes a range of indices.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/curved_voxel_clusterer.hpp"
#include "dynains/points.hpp"
#include "dynains/polar_points.hpp"

namespace dynains {

/// One cluster: its points of all scans, oldest scan first, and where each scan begins.
struct ClusterView {
  PolarView points;
  Span<const std::uint32_t> scan_begin;  ///< one more than scans, relative to the window order
  std::size_t scan_count() const { return scan_begin.size() - 1; }
  /// S_k of Eq. 4.
  PolarView scan(std::size_t k) const {
    return points.subview(scan_begin[k] - scan_begin[0], scan_begin[k + 1] - scan_begin[k]);
  }
};

/// Counting sort of a window. Only clusters that were seen by both the oldest and the newest scan
/// can be compared (Eq. 11); the points of the others are left out of the order.
class ClusterSet {
 public:
  /// `window` holds the scans one after another, oldest first; scan k is
  /// [scan_begin[k], scan_begin[k + 1]). `cluster_of` holds a number per point below
  /// `cluster_count`, or kNoCluster. Views returned later hold until the next build.
  void build(PolarView window, Span<const std::uint32_t> scan_begin,
             Span<const std::uint32_t> cluster_of, std::size_t cluster_count) {
    scan_count_ = scan_begin.size() - 1;
    cluster_count_ = cluster_count;
    // Slot of (cluster, scan), shifted by one so that the counts turn into beginnings.
    begin_.assign(cluster_count * scan_count_ + 1, 0);
    for (std::size_t k = 0; k < scan_count_; ++k) {
      std::uint32_t* const counts = begin_.data() + k;
      for (std::size_t i = scan_begin[k]; i < scan_begin[k + 1]; ++i) {
        if (cluster_of[i] != kNoCluster) ++counts[cluster_of[i] * scan_count_];
      }
    }
    comparable_.assign(cluster_count, 0);
    std::uint32_t next = 0;
    for (std::size_t c = 0; c < cluster_count; ++c) {
      std::uint32_t* const counts = begin_.data() + c * scan_count_;
      comparable_[c] = scan_count_ > 1 && counts[0] > 0 && counts[scan_count_ - 1] > 0;
      for (std::size_t k = 0; k < scan_count_; ++k) {
        const std::uint32_t count = comparable_[c] != 0 ? counts[k] : 0;
        counts[k] = next;
        next += count;
      }
    }
    begin_.back() = next;

    ordered_.resize(next);
    next_ = begin_;
    for (std::size_t k = 0; k < scan_count_; ++k) {
      for (std::size_t i = scan_begin[k]; i < scan_begin[k + 1]; ++i) {
        const std::uint32_t cluster = cluster_of[i];
        if (cluster == kNoCluster || comparable_[cluster] == 0) continue;
        const std::uint32_t to = next_[cluster * scan_count_ + k]++;
        ordered_.range[to] = window.range[i];
        ordered_.azimuth[to] = window.azimuth[i];
        ordered_.z[to] = window.z[i];
      }
    }
  }

  std::size_t size() const { return cluster_count_; }
  std::size_t scan_count() const { return scan_count_; }
  /// Whether both the oldest and the newest scan saw the cluster.
  bool comparable(std::size_t cluster) const { return comparable_[cluster] != 0; }

  /// Points of a comparable cluster; empty for others.
  ClusterView operator[](std::size_t cluster) const {
    const std::size_t first = cluster * scan_count_;
    const std::uint32_t begin = begin_[first];
    const std::uint32_t end = begin_[first + scan_count_];
    return {ordered_.view().subview(begin, end - begin), {begin_.data() + first, scan_count_ + 1}};
  }

 private:
  std::size_t scan_count_ = 0;
  std::size_t cluster_count_ = 0;
  std::vector<std::uint32_t> begin_;
  std::vector<std::uint32_t> next_;
  std::vector<std::uint8_t> comparable_;
  PolarBuffer ordered_;
};

}  // namespace dynains
