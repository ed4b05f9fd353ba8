// Extrinsic calibration of a sensor, as text or in a file.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "dynains/pose.hpp"

namespace dynains {

/// Pose of the sensor in the body, T_body_sensor, m. `text` is `x y z qx qy qz qw`, with blanks or
/// commas between the numbers, or the path of a file with one pose in a form of read_trajectory().
/// Throws ConfigError for seven values that are no pose, IoError for a file that has no pose or
/// more than one.
Pose read_extrinsic(const std::string& text);

/// Position of the sensor in the frame of the clouds, m. `text` is `x y z`, with blanks or commas,
/// or a pose as for read_extrinsic(). Throws ConfigError and IoError.
Eigen::Vector3d read_sensor_origin(const std::string& text);

/// Poses of several sensors in the frame of the clouds, m: the rows of a file as of
/// read_trajectory(). Throws IoError.
std::vector<Pose> read_sensor_poses(const std::string& file);

/// `x y z qx qy qz qw` of a pose, with six decimals.
std::string extrinsic_text(const Pose& T_body_sensor);

}  // namespace dynains
