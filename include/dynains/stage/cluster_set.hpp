// Which points of a window make up each cluster and, within a cluster, each scan: the separation by
// time stamp of Eq. 4. Points stay where they are; what is ordered are ranges of them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/simd/bits.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/stage/polar_points.hpp"

namespace dynains {

/// Points [begin, end) of a window, neighbours in a scan that share a cluster.
struct PointRange {
  std::uint32_t begin, end;
};

/// One cluster: ranges of its points in all scans, oldest scan first, none of them empty.
struct ClusterView {
  PolarView window;                       ///< all points; can be read a few places beyond its end
  Span<const PointRange> ranges;          ///< of this cluster
  Span<const std::uint32_t> first_range;  ///< by scan, one more than scans, counted from any number

  std::size_t scan_count() const { return first_range.size() - 1; }
  /// S_k of Eq. 4.
  Span<const PointRange> scan(std::size_t k) const {
    return ranges.subspan(first_range[k] - first_range[0], first_range[k + 1] - first_range[k]);
  }
};

/// Counting sort of a window. Only clusters that were seen by both the oldest and the newest scan
/// can be compared (Eq. 11); the others are left out of the order.
///
/// Neighbours in a scan mostly share a cluster: what is counted and ordered are point_runs of
/// points.
class ClusterSet {
 public:
  /// Points [begin, end) of a scan, neighbours that share a cluster.
  struct PointRun {
    std::uint32_t begin, end;
    std::uint32_t cluster;  ///< or kNoCluster
  };

  /// `window` holds the scans one after another, oldest first, and is of a PolarBuffer, which can
  /// be read a few places beyond its end; scan k is [scan_begin[k], scan_begin[k + 1]).
  /// `cluster_of` holds a number per point below `cluster_count`, or kNoCluster. Views returned
  /// later hold until the next build, and no longer than the window.
  void build(PolarView window, Span<const std::uint32_t> scan_begin,
             Span<const std::uint32_t> cluster_of, std::size_t cluster_count) {
    window_ = window;
    scan_count_ = scan_begin.size() - 1;
    cluster_count_ = cluster_count;
    find_runs(scan_begin, cluster_of);
    count_runs();
    order_runs(scan_begin);
  }

  std::size_t size() const { return cluster_count_; }
  std::size_t scan_count() const { return scan_count_; }
  /// Whether both the oldest and the newest scan saw the cluster.
  bool comparable(std::size_t cluster) const { return comparable_[cluster] != 0; }

  /// All points of scan k, point_run by point_run.
  Span<const PointRun> point_runs(std::size_t k) const {
    return Span<const PointRun>(point_runs_)
        .subspan(first_run_[k], first_run_[k + 1] - first_run_[k]);
  }

  /// A comparable cluster; without ranges for others.
  ClusterView operator[](std::size_t cluster) const {
    const std::size_t slot = cluster * (scan_count_ + 1);
    const std::uint32_t begin = begin_[slot];
    const std::uint32_t end = begin_[slot + scan_count_];
    return {window_,
            Span<const PointRange>(ranges_).subspan(begin, end - begin),
            {begin_.data() + slot, scan_count_ + 1}};
  }

 private:
  void find_runs(Span<const std::uint32_t> scan_begin, Span<const std::uint32_t> cluster_of) {
    run_count_ = 0;
    first_run_.clear();
    detail::run_max_packs([&](auto packs) {
      using Packs = decltype(packs);
      for (std::size_t k = 0; k < scan_count_; ++k) {
        first_run_.push_back(run_count_);
        cut<Packs>(cluster_of.subspan(scan_begin[k], scan_begin[k + 1] - scan_begin[k]));
      }
    });
    first_run_.push_back(run_count_);
  }

  // One scan, 64 points at a time.
  template <class Packs>
  void cut(Span<const std::uint32_t> cluster_of) {
    constexpr std::size_t kWord = 64;
    std::size_t begin = 0;
    const auto end_at = [&](std::size_t end) {
      point_runs_[run_count_++] = {static_cast<std::uint32_t>(begin),
                                   static_cast<std::uint32_t>(end), cluster_of[begin]};
      begin = end;
    };
    for (std::size_t i = 1; i < cluster_of.size(); i += kWord) {
      detail::grow(point_runs_, run_count_ + kWord + 1);
      const std::uint64_t changes = detail::find_changes<Packs>(
          std::min(kWord, cluster_of.size() - i), cluster_of.data() + i);
      detail::for_each_bit(changes, [&](std::size_t at) { end_at(i + at); });
    }
    detail::grow(point_runs_, run_count_ + 1);
    if (!cluster_of.empty()) end_at(cluster_of.size());
  }

  // Slot of (cluster, scan): counts first, which then turn into beginnings. Behind the slots of
  // each cluster comes its end.
  void count_runs() {
    const std::size_t slots = scan_count_ + 1;
    begin_.assign(cluster_count_ * slots, 0);
    for (std::size_t k = 0; k < scan_count_; ++k) {
      for (const PointRun& point_run : point_runs(k)) {
        if (point_run.cluster != kNoCluster) ++begin_[point_run.cluster * slots + k];
      }
    }
    comparable_.assign(cluster_count_, 0);
    std::uint32_t total = 0;
    for (std::size_t c = 0; c < cluster_count_; ++c) {
      std::uint32_t* const counts = begin_.data() + c * slots;
      comparable_[c] = scan_count_ > 1 && counts[0] > 0 && counts[scan_count_ - 1] > 0;
      for (std::size_t k = 0; k < slots; ++k) {
        const std::uint32_t count = comparable_[c] != 0 ? counts[k] : 0;
        counts[k] = total;
        total += count;
      }
    }
    ranges_.resize(total);
  }

  void order_runs(Span<const std::uint32_t> scan_begin) {
    next_ = begin_;
    for (std::size_t k = 0; k < scan_count_; ++k) {
      const std::uint32_t first = scan_begin[k];
      for (const PointRun& point_run : point_runs(k)) {
        if (point_run.cluster == kNoCluster || comparable_[point_run.cluster] == 0) continue;
        std::uint32_t& next = next_[point_run.cluster * (scan_count_ + 1) + k];
        ranges_[next++] = {first + point_run.begin, first + point_run.end};
      }
    }
  }

  PolarView window_;
  std::size_t scan_count_ = 0;
  std::size_t cluster_count_ = 0;
  std::size_t run_count_ = 0;
  std::vector<PointRun> point_runs_;    // may be more
  std::vector<std::size_t> first_run_;  // by scan
  std::vector<std::uint32_t> begin_;    // range, by slot
  std::vector<std::uint32_t> next_;
  std::vector<std::uint8_t> comparable_;
  std::vector<PointRange> ranges_;
};

}  // namespace dynains
