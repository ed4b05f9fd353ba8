// The level frame: scans are rotated to it, so that results do not depend on the mounting.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>

#include "dynains/points.hpp"
#include "dynains/sensor/mounting.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/simd/pack_geometry.hpp"

namespace dynains {

/// Azimuth (rad, sensor frame) of the direction in which a scan extends farthest, towards the end
/// with more points. It rotates with the points, and so do cells that are laid along it. 0 for an
/// empty scan; coordinates are finite.
inline double estimate_heading(PointsView points) {
  double x = 0.0, y = 0.0;           // sums
  double along = 0.0, across = 0.0;  // second moments, as a vector at twice the angle
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

/// Rotation from the sensor frame to a frame whose x axis points along `heading` (rad, about z).
inline Eigen::Matrix3d R_headed(double heading) {
  return Eigen::AngleAxisd(-heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

namespace detail {

/// Sensor model from one scan, with the rotation from the sensor frame to the level frame.
class LevelFrame {
 public:
  /// `level`: whether scans are rotated at all. `pitch`, `roll`: deg, tilt of the mounting; 0 and 0
  /// if it is to be estimated.
  LevelFrame(bool level, double pitch, double roll)
      : is_wanted_(level),
        is_tilt_given_(pitch != 0.0 || roll != 0.0),
        up_given_(up_of_mounting(pitch, roll)) {}

  /// Not known() before a scan had enough points.
  const SensorModel& sensor() const { return sensor_; }

  /// Whether scans are rotated, by sensor().R_level_sensor().
  bool turns() const { return sensor_.known() && is_wanted_; }

  /// Estimates the sensor from a scan (m, sensor frame).
  void estimate(PointsView scan) {
    Eigen::Matrix3d R_headed_sensor = Eigen::Matrix3d::Identity();
    if (is_wanted_) R_headed_sensor = R_headed(estimate_heading(scan));
    PointBuffer headed;
    const PointsView points = rotate(scan, R_headed_sensor.cast<float>(), headed);
    SensorModel sensor = estimate_sensor_model(points);
    if (!sensor.known()) return;
    const Mounting mounting = estimate_mounting(points);
    if (mounting.known) sensor.height = mounting.height;
    if (is_wanted_) {
      sensor.R_headed_sensor = R_headed_sensor;
      sensor.R_level_headed = R_level_headed(mounting, R_headed_sensor);
    }
    sensor_ = sensor;
  }

  void forget() { sensor_ = {}; }

 private:
  // `mounting`: in the headed frame.
  Eigen::Matrix3d R_level_headed(Mounting mounting, const Eigen::Matrix3d& R_headed_sensor) const {
    constexpr double kLevel = 4.0;  // deg; the estimate for a level sensor is up to 2.6
    if (is_tilt_given_) {
      mounting.up_sensor = R_headed_sensor * up_given_;
      return mounting.R_level_sensor();
    }
    return mounting.known && mounting.tilt() > kLevel ? mounting.R_level_sensor()
                                                      : Eigen::Matrix3d::Identity();
  }

  bool is_wanted_;
  bool is_tilt_given_;
  Eigen::Vector3d up_given_;  // normal of the ground, sensor frame
  SensorModel sensor_;
};

}  // namespace detail
}  // namespace dynains
