// Points seen from a frame that is turned.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/simd/lanes.hpp"
#include "dynains/simd/pack_transform.hpp"
#include "dynains/simd/wide_lanes.hpp"

namespace dynains::detail {

inline PackTransform turning(const Eigen::Matrix3d& R) {
  return PackTransform(rotated(Eigen::Isometry3d::Identity(), transposed(R)));
}

/// Puts turned points to the `begin`-th place of a buffer; they may come from there.
inline void turn(PointsView points, const PackTransform& turning, PointBuffer& turned,
                 std::size_t begin) {
  for_packs(points.size(), [&](auto at) {
    const auto x = at.load(points.x.data());
    const auto y = at.load(points.y.data());
    const auto z = at.load(points.z.data());
    const std::size_t to = begin + at.begin;
    turning(0, x, y, z).store(&turned.x[to]);
    turning(1, x, y, z).store(&turned.y[to]);
    turning(2, x, y, z).store(&turned.z[to]);
  });
}

/// Points in another frame of the same origin; may be `points` of the same buffer.
inline PointsView turn(PointsView points, const Eigen::Matrix3d& R, PointBuffer& turned) {
  turned.grow(points.size() + kMaxPackWidth);
  turn(points, turning(R), turned, 0);
  return PointsView(turned).subview(0, points.size());
}

}  // namespace dynains::detail
