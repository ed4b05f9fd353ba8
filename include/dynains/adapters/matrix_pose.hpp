// Poses from arrays of numbers.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <type_traits>

#include "dynains/errors.hpp"
#include "dynains/pose.hpp"

namespace dynains {

namespace detail {

template <int kStorage, class Scalar>
Pose pose_from_array(const Scalar* values, const char* order, const char* other) {
  static_assert(std::is_floating_point_v<Scalar>, "poses are float or double");
  Pose T;
  T.matrix() =
      Eigen::Map<const Eigen::Matrix<Scalar, 4, 4, kStorage>>(values).template cast<double>();
  const Eigen::RowVector4d unit(0, 0, 0, 1);
  if (T.matrix().row(3) != unit && T.matrix().col(3).transpose() == unit) {
    throw PoseError(std::string("16 numbers read as a ") + order +
                    " pose have the translation in the last row: they are " + other);
  }
  validate_pose(std::string(order) + " pose", T);
  return T;
}

}  // namespace detail

/// Pose from a 4x4 matrix in row-major order, as in C arrays and NumPy: 16 numbers, translation in
/// m. Throws PoseError unless it is a rigid transform; the message for a transposed matrix names
/// the other order.
template <class Scalar>
Pose pose_from_row_major(const Scalar* values) {
  return detail::pose_from_array<Eigen::RowMajor>(values, "row-major", "column-major");
}

/// Pose from a 4x4 matrix in column-major order, as in Eigen, OpenGL and MATLAB: 16 numbers,
/// translation in m. Throws PoseError like pose_from_row_major().
template <class Scalar>
Pose pose_from_column_major(const Scalar* values) {
  return detail::pose_from_array<Eigen::ColMajor>(values, "column-major", "row-major");
}

}  // namespace dynains
