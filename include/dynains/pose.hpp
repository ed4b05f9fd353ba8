// Checks on poses and time stamps.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <sstream>
#include <string>

#include "dynains/errors.hpp"

namespace dynains {

/// Largest deviation of R^T R from identity that still counts as a rotation: text files keep few
/// digits.
inline constexpr double kRotationTolerance = 1e-3;

/// Largest coordinate of a sensor in the world, in metres: more than any map grid on Earth has, and
/// little enough for the indices of a map of any resolution.
inline constexpr double kMaxTranslation = 2.1e7;

/// Throws PoseError unless `T` is finite, rigid and within kMaxTranslation; `name` starts the
/// message.
inline void validate_pose(const std::string& name, const Eigen::Isometry3d& T) {
  if (!T.matrix().allFinite()) {
    throw PoseError(name + " has NaN or infinite entries");
  }
  const Eigen::RowVector4d last = T.matrix().row(3);
  if (last != Eigen::RowVector4d(0, 0, 0, 1)) {
    throw PoseError(name + " is no transform: its last row must be 0 0 0 1");
  }
  const Eigen::Matrix3d R = T.linear();
  const double error = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (error > kRotationTolerance || R.determinant() < 0.0) {
    std::ostringstream text;
    text << name << " is not rigid: R^T R differs from identity by " << error << " (at most "
         << kRotationTolerance << "), det R = " << R.determinant() << " (must be +1)";
    throw PoseError(text.str());
  }
  const double farthest = T.translation().cwiseAbs().maxCoeff();
  if (farthest > kMaxTranslation) {
    std::ostringstream text;
    text << name << " has a translation of " << farthest << " m (at most " << kMaxTranslation
         << " along each axis)";
    throw PoseError(text.str());
  }
}

/// `T` with its rotation made exactly orthonormal.
inline Eigen::Isometry3d orthonormalized(const Eigen::Isometry3d& T) {
  Eigen::Isometry3d result = T;
  result.linear() = Eigen::Quaterniond(T.linear()).normalized().toRotationMatrix();
  return result;
}

}  // namespace dynains
