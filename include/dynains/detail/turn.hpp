// Points seen from a frame that is turned.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "dynains/detail/lane_transform.hpp"
#include "dynains/detail/lanes.hpp"
#include "dynains/detail/wide_lanes.hpp"
#include "dynains/points.hpp"

namespace dynains::detail {

/// Points in another frame of the same origin; may be `points` of the same buffer.
inline PointsView turn(PointsView points, const Eigen::Matrix3f& R, PointBuffer& turned) {
  Eigen::Matrix<float, 3, 4> m = Eigen::Matrix<float, 3, 4>::Zero();
  m.leftCols<3>() = R;
  const LaneTransform transform(m);
  turned.grow(points.size() + kLanes);
  for_lanes(points.size(), [&](auto at) {
    const auto x = at.load(points.x.data());
    const auto y = at.load(points.y.data());
    const auto z = at.load(points.z.data());
    transform(0, x, y, z).store(&turned.x[at.begin]);
    transform(1, x, y, z).store(&turned.y[at.begin]);
    transform(2, x, y, z).store(&turned.z[at.begin]);
  });
  return PointsView(turned).subview(0, points.size());
}

}  // namespace dynains::detail
