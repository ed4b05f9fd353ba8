// Conversion of Sophus poses. Only this header requires Sophus (any version with se3.hpp).
#pragma once

#include <Eigen/Geometry>
#include <sophus/se3.hpp>

#include "dynains/pose.hpp"

namespace dynains {

/// Converts a pose of float or double, m, to the type of DynaInsRemover::push().
template <class Scalar, int kOptions>
Pose to_isometry(const Sophus::SE3<Scalar, kOptions>& T_world_sensor) {
  Pose T = Pose::Identity();
  T.linear() = T_world_sensor.unit_quaternion().template cast<double>().toRotationMatrix();
  T.translation() = T_world_sensor.translation().template cast<double>();
  return T;
}

/// Converts a pose, m, for example ScanVerdict::T_world_sensor. Throws PoseError if `T` is not
/// rigid.
inline Sophus::SE3<double> to_sophus(const Pose& T) {
  validate_pose("T", T);
  return {Eigen::Quaterniond(T.linear()).normalized(), T.translation()};
}

}  // namespace dynains
