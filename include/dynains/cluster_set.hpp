// The points of a window ordered by cluster and, within a cluster, by scan: the separation by
// time stamp of Eq. 4 becomes a range of indices.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/curved_voxel_clusterer.hpp"
#include "dynains/detail/lanes.hpp"
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
///
/// Neighbours in a scan mostly share a cluster: what is counted and moved are streaks of points.
class ClusterSet {
 public:
  /// Points [begin, end) of a scan, neighbours that share a cluster.
  struct Streak {
    std::uint32_t begin, end;
    std::uint32_t cluster;  ///< or kNoCluster
  };

  /// `window` holds the scans one after another, oldest first, and is of a PolarBuffer, which can
  /// be read a few places beyond its end; scan k is [scan_begin[k], scan_begin[k + 1]).
  /// `cluster_of` holds a number per point below `cluster_count`, or kNoCluster. Views returned
  /// later hold until the next build.
  void build(PolarView window, Span<const std::uint32_t> scan_begin,
             Span<const std::uint32_t> cluster_of, std::size_t cluster_count) {
    scan_count_ = scan_begin.size() - 1;
    cluster_count_ = cluster_count;
    find_streaks(scan_begin, cluster_of);
    count_points();
    order_points(window, scan_begin);
  }

  std::size_t size() const { return cluster_count_; }
  std::size_t scan_count() const { return scan_count_; }
  /// Whether both the oldest and the newest scan saw the cluster.
  bool comparable(std::size_t cluster) const { return comparable_[cluster] != 0; }

  /// All points of scan k, streak by streak.
  Span<const Streak> streaks(std::size_t k) const {
    return Span<const Streak>(streaks_).subspan(first_streak_[k],
                                                first_streak_[k + 1] - first_streak_[k]);
  }

  /// Points of a comparable cluster; empty for others.
  ClusterView operator[](std::size_t cluster) const {
    const std::size_t first = cluster * (scan_count_ + 1);
    const std::uint32_t begin = begin_[first];
    const std::uint32_t end = begin_[first + scan_count_];
    return {ordered_.view().subview(begin, end - begin), {begin_.data() + first, scan_count_ + 1}};
  }

 private:
  void find_streaks(Span<const std::uint32_t> scan_begin, Span<const std::uint32_t> cluster_of) {
    streaks_.clear();
    first_streak_.clear();
    for (std::size_t k = 0; k < scan_count_; ++k) {
      first_streak_.push_back(streaks_.size());
      const std::uint32_t end = scan_begin[k + 1];
      const std::uint32_t first = scan_begin[k];
      std::uint32_t begin = first;
      detail::for_each_change(cluster_of.data() + begin, end - begin, [&](std::size_t length) {
        const auto next = begin + static_cast<std::uint32_t>(length);
        streaks_.push_back({begin - first, next - first, cluster_of[begin]});
        begin = next;
      });
    }
    first_streak_.push_back(streaks_.size());
  }

  // Slot of (cluster, scan): counts first, which then turn into beginnings. Behind the slots of
  // each cluster comes its end.
  void count_points() {
    const std::size_t slots = scan_count_ + 1;
    begin_.assign(cluster_count_ * slots, 0);
    for (std::size_t k = 0; k < scan_count_; ++k) {
      for (const Streak& streak : streaks(k)) {
        if (streak.cluster == kNoCluster) continue;
        begin_[streak.cluster * slots + k] += streak.end - streak.begin;
      }
    }
    comparable_.assign(cluster_count_, 0);
    ordered_count_ = 0;
    for (std::size_t c = 0; c < cluster_count_; ++c) {
      std::uint32_t* const counts = begin_.data() + c * slots;
      comparable_[c] = scan_count_ > 1 && counts[0] > 0 && counts[scan_count_ - 1] > 0;
      for (std::size_t k = 0; k < slots; ++k) {
        const std::uint32_t count = comparable_[c] != 0 ? counts[k] : 0;
        counts[k] = ordered_count_;
        ordered_count_ += count;
      }
      if (comparable_[c] != 0) ordered_count_ += detail::kLanes;
    }
  }

  // Eight points at a time: what is written behind the end of a streak is written over by the next
  // one, or lies in the gap behind the cluster.
  void order_points(PolarView window, Span<const std::uint32_t> scan_begin) {
    ordered_.resize(ordered_count_);
    next_ = begin_;
    for (std::size_t k = 0; k < scan_count_; ++k) {
      const PolarView scan = window.subview(scan_begin[k], scan_begin[k + 1] - scan_begin[k]);
      for (const Streak& streak : streaks(k)) {
        if (streak.cluster == kNoCluster || comparable_[streak.cluster] == 0) continue;
        std::uint32_t& next = next_[streak.cluster * (scan_count_ + 1) + k];
        std::size_t to = next;
        for (std::size_t i = streak.begin; i < streak.end; i += detail::kLanes) {
          detail::copy_lanes(scan.range.data() + i, ordered_.range.data() + to);
          detail::copy_lanes(scan.azimuth.data() + i, ordered_.azimuth.data() + to);
          detail::copy_lanes(scan.z.data() + i, ordered_.z.data() + to);
          to += detail::kLanes;
        }
        next += streak.end - streak.begin;
      }
    }
  }

  std::size_t scan_count_ = 0;
  std::size_t cluster_count_ = 0;
  std::uint32_t ordered_count_ = 0;
  std::vector<Streak> streaks_;
  std::vector<std::size_t> first_streak_;  // by scan
  std::vector<std::uint32_t> begin_;
  std::vector<std::uint32_t> next_;
  std::vector<std::uint8_t> comparable_;
  PolarBuffer ordered_;
};

}  // namespace dynains
