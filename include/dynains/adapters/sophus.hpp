// Poses of Sophus. Needs Sophus (any version with se3.hpp); nothing else of dynains does.
#pragma once

#include <Eigen/Geometry>
#include <sophus/se3.hpp>

#include "dynains/pose.hpp"

namespace dynains {

/// `T_world_sensor` of float or double as the pose that DynaInsRemover::push() takes.
template <class Scalar, int kOptions>
Eigen::Isometry3d to_isometry(const Sophus::SE3<Scalar, kOptions>& T_world_sensor) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = T_world_sensor.unit_quaternion().template cast<double>().toRotationMatrix();
  T.translation() = T_world_sensor.translation().template cast<double>();
  return T;
}

/// The pose of a ScanVerdict for code that goes on with Sophus. Throws PoseError if `T` is not
/// rigid.
inline Sophus::SE3<double> to_sophus(const Eigen::Isometry3d& T) {
  validate_pose("T", T);
  return {Eigen::Quaterniond(T.linear()).normalized(), T.translation()};
}

}  // namespace dynains
