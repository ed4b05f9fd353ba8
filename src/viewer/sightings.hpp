// Which scans saw through the places of removed points.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "dynains/pose.hpp"
#include "view_data.hpp"

namespace dynains::viewer {

/// Scans whose beams are compared with the points of scan i: every step()-th scan of the page from
/// i - lookback() to i + lookahead, at most 64.
class ReferenceWindow {
 public:
  static constexpr std::size_t kMost = 64;

  /// In scans, as FreeSpaceConfig; `step` is at least 1. Too large a window loses its oldest scans,
  /// and its newest beyond 32 references.
  ReferenceWindow(std::size_t lookback, std::size_t lookahead, std::size_t step)
      : lookahead_(std::min(lookahead, kMost / 2 * step)),
        lookback_(std::min(lookback, (kMost - 1 - lookahead_ / step) * step)),
        step_(step) {}

  std::size_t step() const { return step_; }
  std::size_t lookback() const { return lookback_; }
  bool is_reference(std::size_t scan) const { return scan % step_ == 0; }
  bool contains(std::size_t scan, std::size_t reference) const {
    return reference + lookback_ >= scan && reference <= scan + lookahead_ && reference != scan;
  }
  /// Index of the first reference of the window of `scan`, which bit 0 of Sightings stands for.
  std::size_t first(std::size_t scan) const {
    const std::size_t begin = scan > lookback_ ? scan - lookback_ : 0;
    return (begin + step_ - 1) / step_ * step_;
  }

 private:
  std::size_t lookahead_, lookback_, step_;
};

/// Compares points with the beams of reference scans.
///
/// A beam passed through the place of a point at range r if the returns within about 0.6 deg of its
/// direction are all farther than r by more than 0.3 m + 1 % of r. It was returned there if the
/// nearest of them is as far as r within that margin. Without such returns, or with a nearer one,
/// the scan says nothing.
class SightingFinder {
 public:
  /// `points` outlives this.
  SightingFinder(const std::vector<ViewPoint>& points, const ReferenceWindow& window);

  /// Compares the points whose window has the scan `reference`. `xyzi`: x y z intensity of its
  /// points, interleaved, m, sensor frame. `T_sensor_local`: from the frame of ViewPoint::local.
  void compare(std::size_t reference, const Pose& T_sensor_local, const std::vector<float>& xyzi);

  /// By point. Call it after the last scan.
  std::vector<Sightings> take() { return std::move(sightings_); }

 private:
  void make_image(const std::vector<float>& xyzi);
  float nearest_around(const Eigen::Vector3f& p) const;

  const std::vector<ViewPoint>& points_;
  ReferenceWindow window_;
  std::vector<std::vector<std::uint32_t>> by_scan_;  // indices of points
  std::vector<Sightings> sightings_;
  std::vector<float> image_;  // m, by cell: nearest return
};

}  // namespace dynains::viewer
