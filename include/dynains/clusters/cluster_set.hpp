// Orders the points of a window by cluster and, within a cluster, by scan: the separation by time
// stamp of Eq. 4. The order consists of index ranges; no point is copied.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains {

/// Points as three arrays of equal length.
struct PolarView {
  Span<const float> range;    ///< m, horizontal distance r(p) (Eq. 8)
  Span<const float> azimuth;  ///< rad, theta(p) in [-pi, pi] (Eq. 8)
  Span<const float> z;        ///< m, height in the sensor frame

  std::size_t size() const { return range.size(); }
  bool empty() const { return range.empty(); }
  PolarView subview(std::size_t offset, std::size_t count) const {
    return {range.subspan(offset, count), azimuth.subspan(offset, count), z.subspan(offset, count)};
  }
};

/// Polar points in three arrays, which are padded for packs beyond size(). A buffer is reused from
/// scan to scan.
class PolarBuffer {
 public:
  std::size_t size() const { return size_; }
  void clear() { size_ = 0; }
  /// Sets the number of points; new ones are not initialized.
  void resize(std::size_t size) {
    size_ = size;
    const std::size_t padded = size + detail::kPackWidth;
    detail::grow(range, padded);
    detail::grow(azimuth, padded);
    detail::grow(z, padded);
  }
  PolarView view() const {
    return {{range.data(), size_}, {azimuth.data(), size_}, {z.data(), size_}};
  }

  /// Appends `points` (m, source frame), transformed to the target frame in single precision.
  void append(PointsView points, const Pose& T_target_source) {
    const std::size_t begin = size_;
    resize(begin + points.size());
    const detail::PackTransform transform(T_target_source);
    float* const ranges = range.data() + begin;
    float* const azimuths = azimuth.data() + begin;
    float* const heights = z.data() + begin;
    detail::for_packs(points.size(), [&](auto at) {
      using Float = typename decltype(at)::Float;
      const Float x = at.load(points.x.data());
      const Float y = at.load(points.y.data());
      const Float z_source = at.load(points.z.data());
      const Float x_target = transform(0, x, y, z_source);
      const Float y_target = transform(1, x, y, z_source);
      const Float range_target = sqrt(x_target * x_target + y_target * y_target);
      range_target.store(ranges + at.begin);
      detail::azimuth_of(y_target, x_target, range_target).store(azimuths + at.begin);
      transform(2, x, y, z_source).store(heights + at.begin);
    });
  }

  std::vector<float> range;
  std::vector<float> azimuth;
  std::vector<float> z;

 private:
  std::size_t size_ = 0;
};

/// Points [begin, end) of a window: consecutive points of one scan and one cluster.
struct PointRange {
  std::uint32_t begin, end;
};

/// One cluster: the ranges of its points in all scans, oldest scan first. No range is empty.
struct ClusterView {
  PolarView window;               ///< all points of the window, padded for packs
  Span<const PointRange> ranges;  ///< of this cluster
  /// By scan, plus the end: number of the first range. `ranges` begins at number first_range[0].
  Span<const std::uint32_t> first_range;

  /// Number of scans of the window, K of Eq. 3 or less.
  std::size_t scan_count() const { return first_range.size() - 1; }
  /// The first scan with points of the cluster, which has points.
  std::size_t oldest() const {
    std::size_t k = 0;
    while (first_range[k] == first_range[k + 1]) ++k;
    return k;
  }
  /// S_k of Eq. 4; `k` is below scan_count().
  Span<const PointRange> scan(std::size_t k) const {
    return ranges.subspan(first_range[k] - first_range[0], first_range[k + 1] - first_range[k]);
  }
};

/// Which clusters of a window are compared.
enum class Comparison {
  kEnds,       ///< with points in both the oldest and the newest scan of the window (Eq. 11)
  kAnyBefore,  ///< with points in the newest scan and in any other
};

constexpr std::array<const char*, 2> value_names(Comparison) { return {"ends", "any_before"}; }

/// Counting sort of a window by cluster and scan. The order leaves out clusters that are not
/// compared.
///
/// Consecutive points mostly share a cluster, so the sort moves runs of points, not single points.
class ClusterSet {
 public:
  /// Points [begin, end) of a scan: consecutive points of one cluster.
  struct PointRun {
    std::uint32_t begin, end;
    std::uint32_t cluster;  ///< or kNoCluster
  };

  /// `window`: view of a PolarBuffer with the scans one after another, oldest first; scan k is
  /// [scan_begin[k], scan_begin[k + 1]). `cluster_of`: by point of the window, cluster number below
  /// `cluster_count`, or kNoCluster. Views of the set are valid until the next build() and as long
  /// as `window` is valid.
  void build(PolarView window, Span<const std::uint32_t> scan_begin,
             Span<const std::uint32_t> cluster_of, std::size_t cluster_count,
             Comparison comparison = Comparison::kEnds) {
    comparison_ = comparison;
    window_ = window;
    scan_count_ = scan_begin.size() - 1;
    cluster_count_ = cluster_count;
    find_runs(scan_begin, cluster_of);
    count_runs();
    order_runs(scan_begin);
  }

  /// Number of clusters, and of scans of the window.
  std::size_t size() const { return cluster_count_; }
  std::size_t scan_count() const { return scan_count_; }
  /// Whether the cluster is compared.
  bool comparable(std::size_t cluster) const { return comparable_[cluster] != 0; }

  /// The runs of all points of scan k, in scan order.
  Span<const PointRun> point_runs(std::size_t k) const {
    return Span<const PointRun>(point_runs_)
        .subspan(first_run_[k], first_run_[k + 1] - first_run_[k]);
  }

  /// View of a cluster; it has no ranges unless the cluster is comparable().
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
    point_runs_.clear();
    first_run_.clear();
    detail::with_packs([&](auto packs) {
      using Packs = decltype(packs);
      for (std::size_t k = 0; k < scan_count_; ++k) {
        first_run_.push_back(point_runs_.size());
        const std::uint32_t* const clusters = cluster_of.data() + scan_begin[k];
        detail::for_each_run<Packs>(
            scan_begin[k + 1] - scan_begin[k],
            [&](std::size_t begin, std::size_t end) {
              point_runs_.push_back({static_cast<std::uint32_t>(begin),
                                     static_cast<std::uint32_t>(end), clusters[begin]});
            },
            clusters);
      }
    });
    first_run_.push_back(point_runs_.size());
  }

  // Counts the runs of each slot (cluster, scan), then replaces each count by the number of the
  // first range of the slot. An additional slot behind each cluster holds its end.
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
      comparable_[c] = is_compared({counts, scan_count_}) ? 1 : 0;
      for (std::size_t k = 0; k < slots; ++k) {
        const std::uint32_t count = comparable_[c] != 0 ? counts[k] : 0;
        counts[k] = total;
        total += count;
      }
    }
    ranges_.resize(total);
  }

  // `counts`: ranges by scan.
  bool is_compared(Span<const std::uint32_t> counts) const {
    if (counts.size() < 2 || counts[counts.size() - 1] == 0) return false;
    if (comparison_ == Comparison::kEnds) return counts[0] > 0;
    return std::any_of(counts.begin(), counts.end() - 1,
                       [](std::uint32_t count) { return count > 0; });
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
  Comparison comparison_ = Comparison::kEnds;
  std::size_t scan_count_ = 0;
  std::size_t cluster_count_ = 0;
  std::vector<PointRun> point_runs_;
  std::vector<std::size_t> first_run_;  // by scan, and the end
  std::vector<std::uint32_t> begin_;    // by slot: number of its first range
  std::vector<std::uint32_t> next_;
  std::vector<std::uint8_t> comparable_;
  std::vector<PointRange> ranges_;
};

}  // namespace dynains
