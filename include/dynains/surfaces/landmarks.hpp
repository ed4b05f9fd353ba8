// Points of a scan for the comparison with other scans.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <memory>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/mounting.hpp"
#include "dynains/surfaces/surface_grid.hpp"

namespace dynains {

/// Number of landmarks from which on a scan determines its motion.
inline constexpr std::size_t kMinLandmarks = 60;
/// Nearer points (m) of two scans agree.
inline constexpr double kAgreeing = 0.3;

/// Agreement of two scans above the ground.
struct Agreement {
  double share = 0.0;      ///< ratio of points with a point of the other scan within 0.3 m, [0, 1]
  double gap = 1.0;        ///< mean distance to the nearest point of the other scan, m, at most 1
  std::size_t points = 0;  ///< number of compared points
};

/// Points of one scan: above the ground, 2 m to `farthest` from the sensor, one per voxel of 0.25
/// m, sorted by voxel. The first search builds a tree; only after it may threads search at once.
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
  /// Agreement of `other` with this scan under the pose `T_this_other`, at about 1200 points. It is
  /// symmetric except for occlusion.
  Agreement compare(const Landmarks& other, const Pose& T_this_other) const;
  /// Surfaces through the points; the first call builds them.
  const SurfaceGrid& surfaces() const;
  /// Distance from `p` (m, sensor frame) to the nearest point, m, at most 1.
  double distance_to(const Eigen::Vector3d& p) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace dynains
