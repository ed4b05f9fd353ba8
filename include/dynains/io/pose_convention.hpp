// Conventions of pose files.
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "dynains/io/trajectory.hpp"
#include "dynains/pose.hpp"

namespace dynains {

/// Moving frame of the poses in a file.
enum class PoseFrame {
  kAuto,   ///< kCamera for rows of 12 numbers with a calib.txt, else kLidar
  kLidar,  ///< frame of the points
  kCamera  ///< z forward, x right, y down; converted by `Tr` of calib.txt, else by camera_axes()
};

/// Names as in options.
constexpr std::array<const char*, 3> value_names(PoseFrame) { return {"auto", "lidar", "camera"}; }

/// Range of PoseConvention::scale.
inline constexpr double kMinPoseScale = 0.1;
inline constexpr double kMaxPoseScale = 10.0;

/// Conversion of the rows of a pose file to poses of the sensor in the world frame, m. By default,
/// rows are used without conversion.
struct PoseConvention {
  bool invert = false;       ///< rows are T_sensor_world
  double unit = 1.0;         ///< m per unit of translation, for example 0.001 for millimetres
  double scale = 1.0;        ///< factor of translations, for an odometry with a wrong scale
  bool left_handed = false;  ///< the y axis of the poses is mirrored, as in some simulators
  PoseFrame frame = PoseFrame::kAuto;
  /// Order of the quaternions in the file; kNone: the order that its format defines.
  QuaternionOrder quaternion = QuaternionOrder::kNone;
  int shift = 0;  ///< scan i has the pose of scan i + shift
  /// Extrinsic calibration: pose of the sensor in the body whose poses the file has, m.
  Pose T_body_sensor = Pose::Identity();
};

/// Applies a convention, except `frame`, `shift` and `T_body_sensor`, to a row. `read_as`: order in
/// which the quaternion of the row was read.
inline Pose apply(const PoseConvention& convention, const Pose& row, QuaternionOrder read_as) {
  Pose pose = row;
  const QuaternionOrder meant = convention.quaternion;
  if (meant != QuaternionOrder::kNone && read_as != QuaternionOrder::kNone && meant != read_as) {
    const detail::Quaternion q(row.linear());
    const detail::Quaternion other = meant == QuaternionOrder::kWxyz
                                         ? detail::Quaternion(q.x(), q.y(), q.z(), q.w())
                                         : detail::Quaternion(q.z(), q.w(), q.x(), q.y());
    pose.linear() = other.normalized().toRotationMatrix();
  }
  pose.translation() *= convention.unit * convention.scale;
  if (convention.invert) pose = pose.inverse();
  if (convention.left_handed) {
    const Eigen::Vector3d mirror(1.0, -1.0, 1.0);
    pose.linear() = (mirror.asDiagonal() * pose.linear() * mirror.asDiagonal()).eval();
    pose.translation() = mirror.cwiseProduct(pose.translation());
  }
  return pose;
}

/// T_camera_sensor for a sensor with x forward, y left, z up and a camera with z forward, x right,
/// y down, and a common origin.
inline Pose camera_axes() {
  Pose T_camera_sensor = Pose::Identity();
  T_camera_sensor.linear() << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  return T_camera_sensor;
}

}  // namespace dynains
