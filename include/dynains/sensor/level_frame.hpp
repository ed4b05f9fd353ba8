// The frame that scans are turned to before anything is laid over them: along the scene, and level.
#pragma once

#include <Eigen/Geometry>

#include "dynains/points.hpp"
#include "dynains/sensor/heading.hpp"
#include "dynains/sensor/mounting.hpp"
#include "dynains/sensor/rotation.hpp"
#include "dynains/sensor/sensor_model.hpp"

namespace dynains::detail {

/// What one scan tells about the sensor, and the turn that makes it level.
class LevelFrame {
 public:
  /// `level`: whether scans are turned at all. `pitch`, `roll`: deg, tilt of the sensor's mounting;
  /// 0 and 0 if it is to be found.
  LevelFrame(bool level, double pitch, double roll)
      : is_wanted_(level),
        is_tilt_given_(pitch != 0.0 || roll != 0.0),
        up_given_(up_of_mounting(pitch, roll)) {}

  /// Not known() until some scan had enough points.
  const SensorModel& sensor() const { return sensor_; }

  void forget() { sensor_ = {}; }

  /// Measures the sensor by a scan (m, sensor frame).
  void estimate(PointsView scan) {
    Eigen::Matrix3d R_headed_sensor = Eigen::Matrix3d::Identity();
    if (is_wanted_) R_headed_sensor = R_headed(estimate_heading(scan));
    PointBuffer turned;
    const PointsView points = turn(scan, R_headed_sensor.cast<float>(), turned);
    SensorModel sensor = estimate_sensor_model(points);
    if (!sensor.known()) return;
    const Mounting mounting = estimate_mounting(points);
    if (mounting.known) sensor.height = mounting.height;
    if (is_wanted_) {
      sensor.R_headed_sensor = R_headed_sensor;
      sensor.R_level_headed = level(mounting, R_headed_sensor);
    }
    sensor_ = sensor;
  }

  /// Whether scans are turned: by R_level_sensor() of the sensor.
  bool turns() const { return sensor_.known() && is_wanted_; }

 private:
  // The turn that makes a tilted sensor level; `mounting` as seen from the headed frame.
  Eigen::Matrix3d level(Mounting mounting, const Eigen::Matrix3d& R_headed_sensor) const {
    constexpr double kLevel = 4.0;  // deg; level sensors seem to be tilted by up to 2.6
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

}  // namespace dynains::detail
