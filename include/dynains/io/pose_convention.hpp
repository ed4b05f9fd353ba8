// Conventions of pose files.
#pragma once

#include <Eigen/Geometry>

#include "dynains/io/trajectory.hpp"

namespace dynains {

/// The frame whose pose a row gives.
enum class PoseFrame {
  kAuto,   ///< kCamera for rows of 12 numbers beside a calib.txt, else kLidar
  kLidar,  ///< that of the points
  kCamera  ///< z forward, x right, y down; turned by `Tr` of calib.txt, or else by these axes
};

/// How rows become poses of the sensor in the world, in metres. With default values, rows are used
/// unchanged.
struct PoseConvention {
  bool invert = false;       ///< rows are from the world to the sensor
  double unit = 1.0;         ///< m per unit of translation: 0.001 for millimetres
  bool left_handed = false;  ///< the y axis of the poses is mirrored, as in some simulators
  PoseFrame frame = PoseFrame::kAuto;
  /// Order of the quaternions in the file; kNone: the usual order of its format.
  QuaternionOrder quaternion = QuaternionOrder::kNone;
  int shift = 0;  ///< scan i has the pose of scan i + shift
};

/// Applies a convention, except its `frame` and `shift`, to a row. `read_as` is the order in which
/// the quaternion of the row was read.
inline Eigen::Isometry3d apply(const PoseConvention& convention, const Eigen::Isometry3d& row,
                               QuaternionOrder read_as) {
  Eigen::Isometry3d pose = row;
  const QuaternionOrder meant = convention.quaternion;
  if (meant != QuaternionOrder::kNone && read_as != QuaternionOrder::kNone && meant != read_as) {
    const Eigen::Quaterniond q(row.linear());
    const Eigen::Quaterniond other = meant == QuaternionOrder::kWxyz
                                         ? Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w())
                                         : Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y());
    pose.linear() = other.normalized().toRotationMatrix();
  }
  pose.translation() *= convention.unit;
  if (convention.invert) pose = pose.inverse();
  if (convention.left_handed) {
    const Eigen::Vector3d mirror(1.0, -1.0, 1.0);
    pose.linear() = (mirror.asDiagonal() * pose.linear() * mirror.asDiagonal()).eval();
    pose.translation() = mirror.cwiseProduct(pose.translation());
  }
  return pose;
}

/// T_camera_sensor of a sensor with x forward, y left, z up and a camera with z forward, x right, y
/// down.
inline Eigen::Isometry3d camera_axes() {
  Eigen::Isometry3d T_camera_sensor = Eigen::Isometry3d::Identity();
  T_camera_sensor.linear() << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  return T_camera_sensor;
}

}  // namespace dynains
