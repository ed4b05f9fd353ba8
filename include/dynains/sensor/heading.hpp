// Which way a scene runs, so that nothing depends on which way the x axis of the sensor points.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>

#include "dynains/points.hpp"

namespace dynains {

/// Angle about z (rad, from the x axis of the sensor) of the direction in which one scan extends
/// farthest, and of its two ends that to which more of the scan lies. It turns with the points: all
/// cells and sectors that are laid along it fall on the same points whichever way a sensor is
/// mounted. 0 for a scan without points; coordinates are finite.
inline double estimate_heading(PointsView points) {
  double x = 0.0, y = 0.0;           // sums
  double along = 0.0, across = 0.0;  // of second order, as a vector at twice the angle
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double px = static_cast<double>(points.x[i]);
    const double py = static_cast<double>(points.y[i]);
    x += px;
    y += py;
    along += px * px - py * py;
    across += 2.0 * px * py;
  }
  const double heading = 0.5 * std::atan2(across, along);
  const bool ahead = std::cos(heading) * x + std::sin(heading) * y >= 0.0;
  return ahead ? heading : heading + M_PI;
}

/// From the frame of the sensor to one whose x axis points along `heading` (rad, about z).
inline Eigen::Matrix3d R_headed(double heading) {
  return Eigen::AngleAxisd(-heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

}  // namespace dynains
