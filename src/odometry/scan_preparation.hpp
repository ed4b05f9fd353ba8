// Preparation of a scan for its registration: points are de-skewed and thinned out.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::odometry {

class ScanPreparation {
 public:
  struct Point {
    Eigen::Vector3d position;  ///< m, sensor frame at the time of the scan
    std::size_t index;         ///< in the cloud
  };

  /// `nearest`, `farthest`: m, range of the points that are used.
  ScanPreparation(double nearest, double farthest) : nearest_(nearest), farthest_(farthest) {}

  /// `offsets`: s, empty or one per point. `motion`: of the sensor in `period` s; 0: not known.
  void prepare(RawPoints<float> points, Span<const double> offsets, const Pose& motion,
               double period);

  /// Adapts the large voxels to the scan, for the scans after it.
  void adapt();

  /// All points, de-skewed.
  RawPoints<float> cloud() const { return {cloud_.data(), cloud_.size() / 3, 3}; }
  /// One point for each small voxel.
  const std::vector<Point>& map_points() const { return map_points_; }
  /// One point for each large voxel, about as many in every scan.
  const std::vector<Eigen::Vector3d>& keypoints() const { return keypoints_; }

 private:
  void deskew(RawPoints<float> points, Span<const double> offsets, const Pose& motion,
              double period);
  void thin_out();

  double nearest_;
  double farthest_;
  double edge_ = 1.0;  // m, of the large voxels
  std::vector<float> cloud_;
  std::vector<Point> map_points_;
  std::vector<Eigen::Vector3d> keypoints_;
  VoxelHashTable<> taken_;
};

}  // namespace dynains::odometry
