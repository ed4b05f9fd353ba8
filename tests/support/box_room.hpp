// A beam in a room that is a box.
#pragma once

#include "support/standard.hpp"

namespace dynains::test {

/// Unit vector of a direction, rad.
inline Eigen::Vector3d ray_of(double elevation, double azimuth) {
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

/// Distance, m, along `ray` from `place` to the wall of the box with the corners `low` and `high`.
inline double range_to_wall(const Eigen::Vector3d& place, const Eigen::Vector3d& ray,
                            const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  double range = 1e9;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double wall = ray[axis] > 0.0 ? high[axis] : low[axis];
    if (ray[axis] != 0.0) range = std::min(range, (wall - place[axis]) / ray[axis]);
  }
  return range;
}

}  // namespace dynains::test
