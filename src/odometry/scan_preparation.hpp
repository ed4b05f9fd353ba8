// Preparation of a scan for its registration: points are de-skewed and thinned out.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/surfaces/landmarks.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::odometry {

class ScanPreparation {
 public:
  struct Point {
    Eigen::Vector3d position;  ///< m, sensor frame at the mean time of the points
    std::size_t index;         ///< in the cloud
  };

  /// `nearest`, `farthest`: m, range of the points that are used, from `sensors` (at least one),
  /// poses in the frame of the clouds.
  ScanPreparation(double nearest, double farthest, const std::vector<Pose>& sensors)
      : nearest_(nearest), farthest_(farthest) {
    for (const Pose& sensor : sensors) origins_.push_back(sensor.translation());
  }

  /// Copies a scan. `offsets`: s from the stamp, empty or one per point. Throws CloudError for a
  /// sensor without a pose.
  void take(const detail::CloudView& cloud, Span<const double> offsets);
  /// s from the stamp; 0 without offsets. A registration of points that are de-skewed to this time
  /// hardly changes with an error of the velocity.
  double mean_offset() const { return mean_offset_; }
  bool has_one_time() const { return offsets_.empty(); }

  /// De-skews to the mean time and thins out. `motion`: of the sensor in `period` > 0 s.
  void prepare(const Pose& motion, double period);

  /// Adapts the large voxels to the scan, for the scans after it.
  void adapt();
  /// Ratio of all lengths of this and the map to those in streets, (0, 1]: a power of two that
  /// follows the median range of the points, and changes late.
  double scale() const { return scale_; }
  /// The fit (mean weight) that the pattern of points lets one expect: that of one half of them to
  /// the surfaces of the other half.
  double expected_fit() const;

  /// All points, de-skewed.
  RawPoints<float> cloud() const {
    return {cloud_.data(), cloud_.size() / 3, 3, sensors_.empty() ? nullptr : sensors_.data()};
  }
  /// Mean of the sensors, m.
  Eigen::Vector3d centre() const;
  /// One point for each small voxel.
  const std::vector<Point>& map_points() const { return map_points_; }
  /// One point for each large voxel, about as many in every scan.
  const std::vector<Eigen::Vector3d>& keypoints() const { return keypoints_; }
  Landmarks landmarks() const;

 private:
  const Eigen::Vector3d& origin_of(std::size_t i) const {
    return origins_[sensors_.empty() ? 0 : sensors_[i]];
  }
  bool is_timed(std::size_t i) const;
  void deskew(const Pose& motion, double period);
  void thin_out();
  void choose_scale();

  double nearest_;
  double farthest_;
  std::vector<Eigen::Vector3d> origins_;  // m, of beams, by sensor
  double scale_ = 1.0;
  double edge_ = 1.0;       // m, of the large voxels
  double used_edge_ = 1.0;  // m, by this scan: smaller if it has few points
  double mean_offset_ = 0.0;
  std::vector<float> measured_;        // points as they came
  std::vector<std::uint8_t> sensors_;  // of points, of several
  std::vector<double> offsets_;
  std::vector<float> cloud_;
  std::vector<Point> map_points_;
  std::vector<Eigen::Vector3d> keypoints_;
  VoxelHashTable<> taken_;
};

}  // namespace dynains::odometry
