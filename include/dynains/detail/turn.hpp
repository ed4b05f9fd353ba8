// Points seen from a frame that is turned.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "dynains/detail/lane_transform.hpp"
#include "dynains/detail/lanes.hpp"
#include "dynains/detail/wide_lanes.hpp"
#include "dynains/points.hpp"

namespace dynains::detail {

inline LaneTransform turning(const Eigen::Matrix3f& R) {
  Eigen::Matrix<float, 3, 4> m = Eigen::Matrix<float, 3, 4>::Zero();
  m.leftCols<3>() = R;
  return LaneTransform(m);
}

/// Puts turned points to the `begin`-th place of a buffer; they may come from there.
inline void turn(PointsView points, const LaneTransform& turning, PointBuffer& turned,
                 std::size_t begin) {
  for_lanes(points.size(), [&](auto at) {
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
inline PointsView turn(PointsView points, const Eigen::Matrix3f& R, PointBuffer& turned) {
  turned.grow(points.size() + kMostLanes);
  turn(points, turning(R), turned, 0);
  return PointsView(turned).subview(0, points.size());
}

}  // namespace dynains::detail
