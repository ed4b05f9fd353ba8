// Preparation of a scan for its registration: points are de-skewed and thinned out.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/median.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/mounting.hpp"
#include "dynains/surfaces/landmarks.hpp"
#include "dynains/surfaces/scan_registration.hpp"
#include "dynains/surfaces/surface_grid.hpp"
#include "dynains/surfaces/way_search.hpp"
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
  void take(const detail::CloudView& cloud, Span<const double> offsets) {
    measured_.resize(3 * cloud.size());
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      float* const p = &measured_[3 * i];
      cloud.copy(i, 1, p, p + 1, p + 2);
    }
    sensors_.resize(origins_.size() > 1 ? cloud.size() : 0);
    if (!sensors_.empty()) cloud.copy_sensors(sensors_.data());
    for (const std::uint8_t sensor : sensors_) {
      if (sensor < origins_.size()) continue;
      throw CloudError("a point is of sensor " + std::to_string(sensor) + ", there are " +
                       std::to_string(origins_.size()));
    }
    offsets_.assign(offsets.begin(), offsets.end());
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < offsets_.size(); ++i) {
      if (!is_timed(i)) continue;
      sum += offsets_[i];
      ++count;
    }
    mean_offset_ = count > 0 ? sum / static_cast<double>(count) : 0.0;
    choose_scale();
  }
  /// s from the stamp; 0 without offsets. A registration of points that are de-skewed to this time
  /// hardly changes with an error of the velocity.
  double mean_offset() const { return mean_offset_; }
  bool has_one_time() const { return offsets_.empty(); }

  /// De-skews to the mean time and thins out. `motion`: of the sensor in `period` > 0 s.
  void prepare(const Pose& motion, double period) {
    cloud_ = measured_;
    if (!offsets_.empty()) deskew(motion, period);
    thin_out();
  }

  /// Adapts the large voxels to the scan, for the scans after it.
  void adapt() {
    const double share = static_cast<double>(keypoints_.size()) / static_cast<double>(kWanted);
    edge_ = std::clamp(used_edge_ * std::sqrt(std::clamp(share, 0.5, 2.0)), scale_ * 0.3,
                       scale_ * 1.5);  // m
  }
  /// Ratio of all lengths of this and the map to those in streets, (0, 1]: a power of two that
  /// follows the median range of the points, and changes late.
  double scale() const { return scale_; }
  /// The fit (mean weight) that the pattern of points lets one expect: that of one half of them to
  /// the surfaces of the other half.
  double expected_fit() const {
    SurfaceGrid half(true, scale_);
    std::vector<Eigen::Vector3d> others;
    VoxelHashTable<> taken;
    std::mt19937 random;  // halves by any order of points would be those of different beams
    for (const Point& point : map_points_) {
      if (random() % 2 == 0) {
        half.insert(point.position);
      } else if (adds(taken, voxel_at(point.position, used_edge_))) {
        others.push_back(point.position);
      }
    }
    return fit_of(half, others, Pose::Identity());
  }

  /// All points, de-skewed.
  RawPoints<float> cloud() const {
    return {cloud_.data(), cloud_.size() / 3, 3, sensors_.empty() ? nullptr : sensors_.data()};
  }
  /// Mean of the sensors, m.
  Eigen::Vector3d centre() const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& origin : origins_) sum += origin;
    return sum / static_cast<double>(origins_.size());
  }
  /// One point for each small voxel.
  const std::vector<Point>& map_points() const { return map_points_; }
  /// One point for each large voxel, about as many in every scan.
  const std::vector<Eigen::Vector3d>& keypoints() const { return keypoints_; }
  Landmarks landmarks() const {
    PointBuffer points;
    for (const Point& point : map_points_) {
      const float* const p = &cloud_[3 * point.index];
      points.push_back(p[0], p[1], p[2]);
    }
    return Landmarks(points, estimate_mounting(points), kWayRange);
  }

 private:
  static constexpr double kMaxOffset = 0.5;     // s from the stamp, of offsets that can be right
  static constexpr std::size_t kWanted = 2000;  // keypoints

  const Eigen::Vector3d& origin_of(std::size_t i) const {
    return origins_[sensors_.empty() ? 0 : sensors_[i]];
  }
  /// Whether a point is a return with a time.
  bool is_timed(std::size_t i) const {
    const Eigen::Map<const Eigen::Vector3f> p(&measured_[3 * i]);
    return std::abs(offsets_[i]) <= kMaxOffset && p.allFinite() && !p.isZero(0.0F);
  }
  /// Moves points by the nearest of equally spaced poses of the sensor.
  void deskew(const Pose& motion, double period) {
    constexpr double kStep = 0.0005;  // s
    constexpr auto kSteps = static_cast<std::size_t>(4.0 * kMaxOffset / kStep);
    std::vector<Pose> T_mean_point(kSteps + 1);
    for (std::size_t k = 0; k <= kSteps; ++k) {
      const double time = static_cast<double>(k) * kStep - 2.0 * kMaxOffset;
      T_mean_point[k] = detail::scaled_motion(motion, time / period);
    }
    for (std::size_t i = 0; i < offsets_.size(); ++i) {
      if (!is_timed(i)) continue;
      Eigen::Map<Eigen::Vector3f> p(&cloud_[3 * i]);
      const double time = offsets_[i] - mean_offset_ + 2.0 * kMaxOffset;
      p = (T_mean_point[static_cast<std::size_t>(std::lround(time / kStep))] * p.cast<double>())
              .cast<float>();
    }
  }
  void thin_out() {
    constexpr double kSmall = 0.25;  // m
    const double small = scale_ * kSmall, nearest = scale_ * nearest_;
    map_points_.clear();
    taken_.clear();
    for (std::size_t i = 0; 3 * i < cloud_.size(); ++i) {
      const Eigen::Vector3d p = Eigen::Map<const Eigen::Vector3f>(&cloud_[3 * i]).cast<double>();
      const double squared = (p - origin_of(i)).squaredNorm();
      if (p.isZero(0.0) || !(squared > nearest * nearest && squared < farthest_ * farthest_))
        continue;
      if (adds(taken_, voxel_at(p, small))) map_points_.push_back({p, i});
    }
    for (used_edge_ = std::max(edge_, small);; used_edge_ = std::max(0.7 * used_edge_, small)) {
      keypoints_.clear();
      taken_.clear();
      for (const Point& point : map_points_) {
        if (adds(taken_, voxel_at(point.position, used_edge_)))
          keypoints_.push_back(point.position);
      }
      if (2 * keypoints_.size() > kWanted || used_edge_ == small) break;
    }
  }
  void choose_scale() {
    constexpr double kNarrow = 4.0, kWide = 12.0;  // m, median ranges that end a scale of 1
    constexpr double kMinScale = 0.125;
    constexpr std::size_t kStep = 8;  // every 8th point
    std::vector<double> ranges;
    for (std::size_t i = 0; 3 * i < measured_.size(); i += kStep) {
      const Eigen::Map<const Eigen::Vector3f> p(&measured_[3 * i]);
      const double range = (p - origin_of(i).cast<float>()).norm();
      if (!p.isZero(0.0F) && range > kMinScale * nearest_ && range < farthest_)
        ranges.push_back(range);
    }
    if (ranges.empty()) return;
    const double middle = median(std::move(ranges));
    while (scale_ < 1.0 && middle > kWide * scale_) scale_ *= 2.0;
    while (scale_ > kMinScale && middle < kNarrow * scale_) scale_ *= 0.5;
  }

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
