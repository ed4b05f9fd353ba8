// Points of a scan for the comparison with other scans.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <memory>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/poses/diagnosis.hpp"
#include "dynains/sensor/mounting.hpp"

namespace dynains {

/// Points of one scan: above the ground, 2 m to `farthest` from the sensor, one per voxel of 0.25
/// m, sorted by voxel.
class Landmarks {
 public:
  /// `points`: m, sensor frame. If `mounting` is known, points near the ground are excluded.
  /// `farthest`: m, (2, 1000].
  Landmarks(PointsView points, const Mounting& mounting, double farthest = 40.0);
  ~Landmarks();
  Landmarks(Landmarks&&) noexcept;
  Landmarks& operator=(Landmarks&&) noexcept;

  std::size_t size() const { return points().size(); }
  const std::vector<Eigen::Vector3d>& points() const;
  /// Agreement of `other` with this scan under the pose `T_this_other`. It is symmetric except for
  /// occlusion. `most`: compared points, about.
  Agreement compare(const Landmarks& other, const Pose& T_this_other,
                    std::size_t most = 1200) const;
  /// Distance from `p` (m, sensor frame) to the nearest point, m, at most 1.
  double distance_to(const Eigen::Vector3d& p) const;

 private:
  struct Tree;
  std::unique_ptr<const Tree> tree_;
};

/// The mounting that a sample of the points of one scan (m, sensor frame) shows.
Mounting mounting_of(PointsView points);

/// Those of scan i, without the ground under its mounting. `scan`: memory for the scan. Throws
/// IoError.
Landmarks landmarks_of(const Recording& recording, std::size_t i, RecordedScan& scan);

}  // namespace dynains
