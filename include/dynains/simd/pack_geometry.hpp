// Geometry of points in packs: rigid transforms and polar angles.
//
// Angles are polynomials of our own, since libm differs between C libraries in the last bit.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <iterator>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

inline constexpr float kPi = 3.14159265358979323846F;

/// Twice the angle whose tangent is y / x, for x >= |y|; nearly 0 if x < 1e-18.
template <class Float>
Float twice_arc_tangent(const Float& y, const Float& x) {
  static constexpr PackConstant kTiny(1e-18F);
  // Minimax fit of 2 atan(t) / t in t^2 over [0, 1]; error 6.6e-7 including float rounding.
  static constexpr PackConstant kFit[] = {
      1.3623585925e-02F, -6.7208439112e-02F, 1.5924733877e-01F, -2.6466685534e-01F,
      3.9615631104e-01F, -6.6634738445e-01F, 1.9999922514F};
  const Float t = y / max(x, Float(kTiny));
  const Float u = t * t;
  Float p = kFit[0];
  for (std::size_t i = 1; i < std::size(kFit); ++i) p = p * u + kFit[i];
  return p * t;
}

/// Azimuth of (x, y) in [-pi, pi] (rad), absolute error below 1e-6; nearly 0 if `length` < 1e-18.
/// `length`: distance of (x, y) from the origin, at most 1e18. Zeros count as positive: the azimuth
/// of (-1, -0) is pi.
template <class Float>
Float azimuth_of(const Float& y, const Float& x, const Float& length) {
  static constexpr PackConstant kZero(0.0F), kHalfTurn(kPi);
  const Float from_axis = twice_arc_tangent(y, length + abs(x));
  return select(x < kZero, with_sign_of(y + kZero, Float(kHalfTurn)) - from_axis, from_axis);
}

/// Elevation (rad) of a point at the horizontal distance `range` and the height `z`. `length`:
/// distance of the point from the origin.
template <class Float>
Float elevation_of(const Float& z, const Float& range, const Float& length) {
  return twice_arc_tangent(z, length + range);
}

/// An affine transform of points in packs: the first three rows of `scale * T`, in floats.
struct PackTransform {
  explicit PackTransform(const Pose& T, double scale = 1.0)
      : row{row_of(T, scale, 0), row_of(T, scale, 1), row_of(T, scale, 2)} {}

  static PackTransform rotation(const Eigen::Matrix3d& R) {
    return PackTransform(rotated(Pose::Identity(), R.transpose()));
  }

  /// Coordinate number `axis` of the transformed points.
  template <class Float>
  Float operator()(std::size_t axis, const Float& x, const Float& y, const Float& z) const {
    return (row[axis][0] * x + row[axis][1] * y) + (row[axis][2] * z + row[axis][3]);
  }

  std::array<PackConstant, 4> row[3];

 private:
  static std::array<PackConstant, 4> row_of(const Pose& T, double scale, int i) {
    const auto element = [&](int j) { return static_cast<float>(scale * T(i, j)); };
    return {element(0), element(1), element(2), element(3)};
  }
};

/// Stores the transformed points in `to`, from index `begin` on. `points` may be the same memory.
/// `to` must have room for kPackWidth more points.
inline void transform_points(PointsView points, const PackTransform& transform, PointBuffer& to,
                             std::size_t begin) {
  for_packs(points.size(), [&](auto at) {
    const auto x = at.load(points.x.data());
    const auto y = at.load(points.y.data());
    const auto z = at.load(points.z.data());
    const std::size_t i = begin + at.begin;
    transform(0, x, y, z).store(&to.x[i]);
    transform(1, x, y, z).store(&to.y[i]);
    transform(2, x, y, z).store(&to.z[i]);
  });
}

/// The rotated points, held by `rotated`. `points` may be held by the same buffer.
inline PointsView rotate(PointsView points, const Eigen::Matrix3d& R, PointBuffer& rotated) {
  rotated.grow(points.size() + kPackWidth);
  transform_points(points, PackTransform::rotation(R), rotated, 0);
  return PointsView(rotated).subview(0, points.size());
}

}  // namespace dynains::detail
