// An affine transform of eight points at a time.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "dynains/simd/pack.hpp"

namespace dynains::detail {

/// Rows of a 3x4 matrix, spread once for all points.
struct PackTransform {
  explicit PackTransform(const Eigen::Matrix<float, 3, 4>& m)
      : row{{m(0, 0), m(0, 1), m(0, 2), m(0, 3)},
            {m(1, 0), m(1, 1), m(1, 2), m(1, 3)},
            {m(2, 0), m(2, 1), m(2, 2), m(2, 3)}} {}

  /// One coordinate of the transformed points.
  template <class Float>
  Float operator()(std::size_t axis, const Float& x, const Float& y, const Float& z) const {
    return (row[axis][0] * x + row[axis][1] * y) + (row[axis][2] * z + row[axis][3]);
  }

  PackConstant row[3][4];
};

}  // namespace dynains::detail
