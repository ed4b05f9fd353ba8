// Motions by the poses as given, and the sizes of motions.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>

#include "dynains/io/recording.hpp"
#include "dynains/pose.hpp"

namespace dynains {

/// Pose of scan k in the sensor frame of scan i.
inline Pose motion_between(const Recording& recording, std::size_t i, std::size_t k) {
  return recording.T_world_sensor(i).inverse() * recording.T_world_sensor(k);
}

/// Angle of a rotation, rad, not negative.
inline double angle_of(const Eigen::Matrix3d& R) {
  return std::abs(Eigen::AngleAxisd(detail::Quaternion(R)).angle());
}

using detail::kLever;

/// Size of a motion, m, for points kLever away.
inline double extent_of(const Pose& T) {
  return std::hypot(T.translation().norm(), kLever * angle_of(T.linear()));
}

}  // namespace dynains
