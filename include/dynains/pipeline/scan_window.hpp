// Sliding window of scans (Eq. 3) and its clusters (Eq. 4).
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "dynains/clusters/polar_points.hpp"
#include "dynains/errors.hpp"
#include "dynains/pipeline/scan_ring.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"

namespace dynains::detail {

/// Non-ground points of consecutive scans in m, level frame of the newest scan, oldest scan first.
class ScanWindow {
 public:
  /// Collects the last `length` scans, or fewer if the epoch of the newest scan has fewer.
  void gather(ScanRing& scans, std::size_t length) {
    const ScanSlot& newest = scans.newest();
    first_scan_ = scans.pushed() - std::min<std::uint64_t>(scans.pushed(), length);
    while (scans[first_scan_].epoch != newest.epoch) ++first_scan_;
    points_.clear();
    scan_begin_.assign(1, 0);
    const Pose T_newest_world = inverted(newest.T_world_level);
    for (std::uint64_t scan = first_scan_; scan < scans.pushed(); ++scan) {
      points_.append(scans[scan].split.non_ground(),
                     composed(T_newest_world, scans[scan].T_world_level));
      scan_begin_.push_back(static_cast<std::uint32_t>(points_.size()));
    }
  }

  /// Clusters the points of the window. Throws UsageError unless the clusterer returns one number
  /// per point.
  template <class Clusterer>
  void cluster(Clusterer& clusterer) {
    cluster_of_ = clusterer.cluster(points_.view());
    cluster_count_ = clusterer.cluster_count();
    if (cluster_of_.size() == points_.size()) return;
    throw UsageError("Stages::Clusterer gave " + std::to_string(cluster_of_.size()) +
                     " cluster numbers for " + std::to_string(points_.size()) + " points");
  }

  /// Number of the oldest scan.
  std::uint64_t first_scan() const { return first_scan_; }
  std::size_t scan_count() const { return scan_begin_.size() - 1; }
  PolarView points() const { return points_.view(); }
  /// Index of the first point of each scan, and the number of points as last element.
  Span<const std::uint32_t> scan_begin() const { return scan_begin_; }

  std::size_t cluster_count() const { return cluster_count_; }
  /// Cluster number of each point, or kNoCluster. Valid until the clusterer is called again.
  Span<const std::uint32_t> cluster_of() const { return cluster_of_; }
  /// Cluster number of each point of the newest scan, or kNoCluster.
  Span<const std::uint32_t> newest_cluster_of() const {
    const std::size_t begin = scan_begin_[scan_count() - 1];
    return cluster_of_.subspan(begin, cluster_of_.size() - begin);
  }

 private:
  std::uint64_t first_scan_ = 0;
  PolarBuffer points_;
  std::vector<std::uint32_t> scan_begin_;
  Span<const std::uint32_t> cluster_of_;
  std::size_t cluster_count_ = 0;
};

}  // namespace dynains::detail
