// An affine transform of eight points at a time.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>

#include "dynains/simd/lanes.hpp"

namespace dynains::detail {

/// The first three rows of `scale * T` in floats, spread once for all points.
struct PackTransform {
  explicit PackTransform(const Eigen::Isometry3d& T, double scale = 1.0)
      : row{row_of(T, scale, 0), row_of(T, scale, 1), row_of(T, scale, 2)} {}

  /// One coordinate of the transformed points.
  template <class Float>
  Float operator()(std::size_t axis, const Float& x, const Float& y, const Float& z) const {
    return (row[axis][0] * x + row[axis][1] * y) + (row[axis][2] * z + row[axis][3]);
  }

  std::array<PackConstant, 4> row[3];

 private:
  static std::array<PackConstant, 4> row_of(const Eigen::Isometry3d& T, double scale, int i) {
    const auto element = [&](int j) { return static_cast<float>(scale * T(i, j)); };
    return {element(0), element(1), element(2), element(3)};
  }
};

}  // namespace dynains::detail
