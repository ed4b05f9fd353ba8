// The pose type, validation of poses, and operations on rigid transforms.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <sstream>
#include <string>

#include "dynains/errors.hpp"

namespace dynains {

/// Rigid transform, T_target_source. It converts from and to Eigen::Isometry3d, whose alignment
/// depends on the flags of the compiler. The layout of this type does not, so a program may use
/// compiled components that were built with other flags.
using Pose = Eigen::Transform<double, 3, Eigen::Isometry, Eigen::DontAlign>;

/// Largest accepted deviation of an element of R^T R from identity. Text files round rotations.
inline constexpr double kRotationTolerance = 1e-3;

/// Largest accepted coordinate of a sensor in the world frame, m. It exceeds the coordinates of all
/// map grids on Earth and limits the voxel indices of a map.
inline constexpr double kMaxTranslation = 2.1e7;

namespace detail {

inline constexpr double kRadians = M_PI / 180.0;  ///< in a degree
/// Distance (m) of the points at which a rotation is as long as a translation.
inline constexpr double kLever = 10.0;

/// Without the alignment that depends on flags, as Pose.
using Quaternion = Eigen::Quaternion<double, Eigen::DontAlign>;

// These operations use coefficients instead of Eigen's expression templates, which compile slowly.

/// T_a_c = T_a_b T_b_c.
inline Pose composed(const Pose& T_a_b, const Pose& T_b_c) {
  Pose T_a_c = T_a_b;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 4; ++j) {
      T_a_c(i, j) =
          T_a_b(i, 0) * T_b_c(0, j) + T_a_b(i, 1) * T_b_c(1, j) + T_a_b(i, 2) * T_b_c(2, j);
    }
    T_a_c(i, 3) += T_a_b(i, 3);
  }
  return T_a_c;
}

/// R_a_c = R_a_b R_b_c.
inline Eigen::Matrix3d composed(const Eigen::Matrix3d& R_a_b, const Eigen::Matrix3d& R_b_c) {
  Eigen::Matrix3d R_a_c;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      R_a_c(i, j) =
          R_a_b(i, 0) * R_b_c(0, j) + R_a_b(i, 1) * R_b_c(1, j) + R_a_b(i, 2) * R_b_c(2, j);
    }
  }
  return R_a_c;
}

/// T_b_a, the inverse of the rigid transform T_a_b.
inline Pose inverted(const Pose& T_a_b) {
  Pose T_b_a = T_a_b;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) T_b_a(i, j) = T_a_b(j, i);
    T_b_a(i, 3) =
        -(T_a_b(0, i) * T_a_b(0, 3) + T_a_b(1, i) * T_a_b(1, 3) + T_a_b(2, i) * T_a_b(2, 3));
  }
  return T_b_a;
}

/// T_a_b from T_a_c and R_b_c. Frames b and c have a common origin.
inline Pose rotated(const Pose& T_a_c, const Eigen::Matrix3d& R_b_c) {
  Pose T_a_b = T_a_c;
  T_a_b.linear() = composed(T_a_c.linear(), R_b_c.transpose());
  return T_a_b;
}

/// Covariance (row-major, 6 x 6) of an error e of a pose T_c_a, if `covariance` is that of an error
/// of T_c_b. An error is a translation (m) and a rotation (rad) along the axes of the inner frame:
/// exact pose = pose * Exp(e).
inline std::array<double, 36> transported_covariance(const std::array<double, 36>& covariance,
                                                     const Pose& T_a_b) {
  const auto at = [](std::size_t i, std::size_t j) { return 6 * i + j; };
  std::array<double, 36> adjoint = {};  // R and [t]_x R; 0 and R
  const Eigen::Vector3d t = T_a_b.translation();
  for (int j = 0; j < 3; ++j) {
    const Eigen::Vector3d column = T_a_b.linear().col(j);
    const double arm[3] = {t[1] * column[2] - t[2] * column[1], t[2] * column[0] - t[0] * column[2],
                           t[0] * column[1] - t[1] * column[0]};
    for (int i = 0; i < 3; ++i) {
      const auto row = static_cast<std::size_t>(i), to = static_cast<std::size_t>(j);
      adjoint[at(row, to)] = adjoint[at(row + 3, to + 3)] = column[i];
      adjoint[at(row, to + 3)] = arm[i];
    }
  }
  const auto times_transposed = [&](const auto& a, const auto& b) {
    std::array<double, 36> product = {};
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < 6; ++j) {
        for (std::size_t k = 0; k < 6; ++k) product[at(i, j)] += a[at(i, k)] * b[at(j, k)];
      }
    }
    return product;
  };
  return times_transposed(times_transposed(adjoint, covariance), adjoint);
}

/// Distance between the origins of two poses, m.
inline double distance(const Pose& a, const Pose& b) {
  double squared = 0.0;
  for (int i = 0; i < 3; ++i) squared += (a(i, 3) - b(i, 3)) * (a(i, 3) - b(i, 3));
  return std::sqrt(squared);
}

/// `ratio` times a motion: its translation and its turn, of less than half a revolution.
inline Pose scaled_motion(const Pose& T_a_b, double ratio) {
  const double w[3] = {T_a_b(2, 1) - T_a_b(1, 2), T_a_b(0, 2) - T_a_b(2, 0),
                       T_a_b(1, 0) - T_a_b(0, 1)};  // twice the sine times the axis
  const double length = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  const double twice_cosine = T_a_b(0, 0) + T_a_b(1, 1) + T_a_b(2, 2) - 1.0;
  const double angle = ratio * std::atan2(length, twice_cosine);
  Pose result = Pose::Identity();
  if (length > 0.0) {
    const double scale = 1.0 / length;
    const Eigen::Vector3d axis(scale * w[0], scale * w[1], scale * w[2]);
    result.linear() = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  }
  for (int i = 0; i < 3; ++i) result(i, 3) = ratio * T_a_b(i, 3);
  return result;
}

/// Largest deviation of an element of R^T R from identity. `T` must be finite.
inline double rotation_error(const Pose& T) {
  const Eigen::Matrix3d R = T.linear();
  return (R.transpose().lazyProduct(R) - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
}

}  // namespace detail

/// Throws PoseError unless `T` is finite, rigid and within kMaxTranslation. The message starts with
/// `name`.
inline void validate_pose(const std::string& name, const Pose& T) {
  if (!T.matrix().allFinite()) throw PoseError(name + " has NaN or infinite entries");
  if (T(3, 0) != 0.0 || T(3, 1) != 0.0 || T(3, 2) != 0.0 || T(3, 3) != 1.0) {
    throw PoseError(name + " is no transform: its last row must be 0 0 0 1");
  }
  const double error = detail::rotation_error(T);
  const double determinant = T.linear().determinant();
  if (error > kRotationTolerance || determinant < 0.0) {
    std::ostringstream text;
    text << name << " is not rigid: R^T R differs from identity by " << error << " (at most "
         << kRotationTolerance << "), det R = " << determinant << " (must be +1)";
    throw PoseError(text.str());
  }
  const double farthest = std::max({std::abs(T(0, 3)), std::abs(T(1, 3)), std::abs(T(2, 3))});
  if (farthest > kMaxTranslation) {
    std::ostringstream text;
    text << name << " has a translation of " << farthest << " m (at most " << kMaxTranslation
         << " along each axis)";
    throw PoseError(text.str());
  }
}

/// The pose of any transform or 4x4 matrix of Eigen, of float or double, m. Does not validate it:
/// see validate_pose().
inline Pose to_pose(const Pose& T_target_source) { return T_target_source; }
template <class Derived>
Pose to_pose(const Eigen::MatrixBase<Derived>& T_target_source) {
  static_assert(Derived::RowsAtCompileTime == 4 && Derived::ColsAtCompileTime == 4,
                "a pose is a 4x4 matrix");
  Pose T;
  T.matrix() = T_target_source.template cast<double>();
  return T;
}
template <class Scalar, int kMode, int kOptions>
Pose to_pose(const Eigen::Transform<Scalar, 3, kMode, kOptions>& T_target_source) {
  return to_pose(T_target_source.matrix());
}

/// `T` with an orthonormalized rotation.
inline Pose orthonormalized(const Pose& T) {
  Pose result = T;
  result.linear() = detail::Quaternion(T.linear()).normalized().toRotationMatrix();
  return result;
}

}  // namespace dynains
