// The clouds of a frame as one cloud, in the frame of the clouds of the first topic. Without types
// of ROS.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dynains/adapters/point_cloud2.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "ros_common/cloud_queue.hpp"
#include "ros_common/frame_joiner.hpp"
#include "ros_common/point_times.hpp"

namespace dynains_ros {

/// Where the sensors and the clouds of several topics are. `CloudPtr` points to a PointCloud2
/// message.
template <class CloudPtr>
class SensorRig {
 public:
  /// `sensor_frames`: by topic, the frame of its sensor; empty: those of the clouds.
  SensorRig(std::size_t topics, std::vector<std::string> sensor_frames)
      : sensor_frames_(std::move(sensor_frames)), sensors_(topics), T_frame_clouds_(topics) {}

  /// Finds the pose of the frame at its stamp, and where its clouds are in it.
  /// `find_pose(const CloudPtr&)` gives a PoseAnswer with the pose of the frame of a cloud at its
  /// stamp, `find_extrinsic(frame, other)` one with that of `other` in `frame` at any time. With
  /// `is_posed` false, find_pose() is not called, and the answer is the identity: then clouds stay
  /// where their sensors measured them.
  template <class FindPose, class FindExtrinsic>
  PoseAnswer place(const Frame<CloudPtr>& frame, bool is_posed, FindPose&& find_pose,
                   FindExtrinsic&& find_extrinsic) {
    if (frame_id_.empty()) {
      if (!frame.clouds.front()) return {std::nullopt, false, "no cloud yet on the first topic"};
      frame_id_ = frame.clouds.front()->header.frame_id;
    }
    const auto extrinsic = [&](const std::string& other) {
      if (other == frame_id_) return PoseAnswer{dynains::Pose::Identity(), true, ""};
      return find_extrinsic(frame_id_, other);
    };
    PoseAnswer result{dynains::Pose::Identity(), true, ""};
    dynains::Pose T_frame_fixed = dynains::Pose::Identity();
    for (std::size_t i = 0; i < frame.clouds.size(); ++i) {
      const CloudPtr& cloud = frame.clouds[i];
      if (!cloud) continue;
      const std::string& cloud_frame = cloud->header.frame_id;
      if (!sensors_[i]) {
        PoseAnswer sensor = extrinsic(sensor_frames_.empty() ? cloud_frame : sensor_frames_[i]);
        if (!sensor.T_fixed_sensor) return sensor;
        sensors_[i] = sensor.T_fixed_sensor;
        has_new_sensor_ = true;
      }
      const bool is_anchor = cloud == frame.anchor();
      if (is_anchor || !is_posed) {
        PoseAnswer fixed = extrinsic(cloud_frame);
        if (!fixed.T_fixed_sensor) return fixed;
        T_frame_clouds_[i] = *fixed.T_fixed_sensor;
      }
      if (!is_posed) continue;
      PoseAnswer moved = find_pose(cloud);
      if (!moved.T_fixed_sensor) return moved;
      if (is_anchor) {
        result.T_fixed_sensor = *moved.T_fixed_sensor * T_frame_clouds_[i].inverse();
        T_frame_fixed = result.T_fixed_sensor->inverse();
      } else {
        T_frame_clouds_[i] = T_frame_fixed * *moved.T_fixed_sensor;
      }
    }
    return result;
  }

  /// Whether place() has found a sensor since the last call.
  bool take_new_sensor() { return std::exchange(has_new_sensor_, false); }
  /// Whether the sensors are not where the clouds of one topic begin.
  bool has_sensors() const { return sensors_.size() > 1 || !sensor_frames_.empty(); }
  /// Poses of the sensors in the frame, m; one that was not found yet has no points.
  std::vector<dynains::Pose> sensors() const {
    std::vector<dynains::Pose> result;
    for (const auto& sensor : sensors_) {
      result.push_back(sensor.value_or(dynains::Pose::Identity()));
    }
    return result;
  }
  /// Frame of the clouds of the first topic.
  const std::string& frame_id() const { return frame_id_; }

  /// The points of the frame that place() took last, cloud by cloud. Throws dynains::CloudError.
  dynains::RawPoints<float> merge(const Frame<CloudPtr>& frame) {
    points_.clear();
    numbers_.clear();
    for (std::size_t i = 0; i < frame.clouds.size(); ++i) {
      if (!frame.clouds[i]) continue;
      const dynains::PointCloud2View view(*frame.clouds[i]);
      const Eigen::Isometry3f T_frame_cloud = T_frame_clouds_[i].template cast<float>();
      for (std::size_t j = 0; j < view.size(); ++j) {
        const Eigen::Vector3f point = view.point(j);
        points_.push_back(point.isZero(0.0F) ? point : T_frame_cloud * point);  // zero: no return
      }
      numbers_.resize(points_.size(), static_cast<std::uint8_t>(i));
    }
    return {points_.empty() ? nullptr : points_.front().data(), points_.size(), 3, numbers_.data()};
  }

  /// For each point of merge() the seconds from the stamp of the frame until it was measured; empty
  /// if one cloud has no times.
  static std::vector<double> offsets(const Frame<CloudPtr>& frame) {
    std::vector<double> result;
    for (const CloudPtr& cloud : frame.clouds) {
      if (!cloud) continue;
      const double stamp = dynains::message_time(*cloud);
      std::vector<double> offsets = point_offsets(*cloud, stamp);
      if (offsets.empty()) {
        if (frame.clouds.size() == 1) return {};
        offsets.resize(dynains::PointCloud2View(*cloud).size());
      }
      for (const double offset : offsets) result.push_back(stamp - frame.stamp + offset);
    }
    return result;
  }

 private:
  std::vector<std::string> sensor_frames_;
  std::string frame_id_;
  std::vector<std::optional<dynains::Pose>> sensors_;  // by topic
  bool has_new_sensor_ = false;
  std::vector<dynains::Pose> T_frame_clouds_;  // of the last frame, by topic
  std::vector<Eigen::Vector3f> points_;
  std::vector<std::uint8_t> numbers_;  // of the sensor, by point
};

}  // namespace dynains_ros
