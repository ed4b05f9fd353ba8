// Whether the sensors of a rig agree with the poses, and with each other.
#pragma once

#include <cmath>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/pose.hpp"

namespace dynains {

/// Findings on one sensor of several.
struct SensorAgreement {
  double points = 0.0;         ///< returns of a scan
  double fit_of_scans = 0.0;   ///< of its points at its surfaces in other scans, as in Registration
  double fit_of_others = 0.0;  ///< of its points at the surfaces of the other sensors
  /// Its pose in the frame of the clouds by a registration to the surfaces of the other sensors.
  /// Along directions that they do not determine, that of the recording stays.
  Pose T_cloud_sensor = Pose::Identity();
  double distance = 0.0;  ///< m, from the pose of the recording
  double angle = 0.0;     ///< rad

  /// Whether the pose of the recording is off by more than 3 cm or 0.3 deg.
  bool is_off() const { return distance > 0.03 || angle > 0.3 * M_PI / 180.0; }
};

/// By sensor of the recording; empty for one alone. Reads a sample of the scans. Throws IoError.
std::vector<SensorAgreement> compare_sensors(const Recording& recording);

}  // namespace dynains
