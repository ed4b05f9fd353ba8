// Points of a scan in the world.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"

namespace dynains {

/// Point i (m, sensor frame) of a scan, m, world frame.
inline Eigen::Vector3d world_point(PointsView points, std::size_t i, const Pose& T_world_sensor) {
  return T_world_sensor * Eigen::Vector3d(static_cast<double>(points.x[i]),
                                          static_cast<double>(points.y[i]),
                                          static_cast<double>(points.z[i]));
}

}  // namespace dynains
