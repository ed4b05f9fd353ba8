// Errors that all points of a sensor share.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "dynains/pose.hpp"

namespace dynains::detail {

/// Movement of a point, along the axes of the map, by one unit (rad) of each error: of all
/// elevations, and of the mounting about the axes x and y of the sensor.
inline constexpr std::size_t kSensorErrors = 3;
using SensorErrors = std::array<std::array<float, 3>, kSensorErrors>;

/// Those of the point (x, y, z) (m, sensor frame).
inline SensorErrors sensor_errors(const Pose& T_map_sensor, double x, double y, double z) {
  const double distance = std::sqrt(x * x + y * y);
  const double along = distance > 0.0 ? -z / distance : 0.0;
  const double moved[kSensorErrors][3] = {
      {along * x, along * y, distance}, {0.0, -z, y}, {z, 0.0, -x}};
  SensorErrors errors;
  for (std::size_t k = 0; k < kSensorErrors; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      errors[k][static_cast<std::size_t>(axis)] = static_cast<float>(
          T_map_sensor(axis, 0) * moved[k][0] + T_map_sensor(axis, 1) * moved[k][1] +
          T_map_sensor(axis, 2) * moved[k][2]);
    }
  }
  return errors;
}

}  // namespace dynains::detail
