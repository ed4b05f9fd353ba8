// Sizes of motions.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "dynains/pose.hpp"

namespace dynains {

using detail::kLever;

/// Angle of a rotation, rad, [0, pi].
inline double angle_of(const Eigen::Matrix3d& R) {
  return std::abs(Eigen::AngleAxisd(detail::Quaternion(R)).angle());
}

/// Size of a motion, m, for points kLever away.
inline double extent_of(const Pose& T) {
  return std::hypot(T.translation().norm(), kLever * angle_of(T.linear()));
}

}  // namespace dynains
