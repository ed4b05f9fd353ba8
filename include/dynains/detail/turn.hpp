// Points seen from a frame that is turned.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "dynains/detail/room.hpp"
#include "dynains/points.hpp"

namespace dynains::detail {

/// Points in another frame of the same origin.
inline void turn(PointsView points, const Eigen::Matrix3f& R, PointBuffer& turned) {
  for (std::vector<float>* const values : {&turned.x, &turned.y, &turned.z}) {
    make_room(*values, points.size());
  }
  turned.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f p = R * Eigen::Vector3f(points.x[i], points.y[i], points.z[i]);
    turned.x[i] = p.x();
    turned.y[i] = p.y();
    turned.z[i] = p.z();
  }
}

}  // namespace dynains::detail
