// The files of a KITTI folder, one by one, and transforms in files.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <vector>

#include "dynains/pose.hpp"

namespace dynains {

inline constexpr double kKittiPeriod = 0.1;  // s, the 10 Hz of KITTI

/// Strictly increasing.
std::vector<double> read_kitti_times(const std::filesystem::path& path);
/// `Tr`, from the sensor to the frame of the poses.
Pose read_kitti_calib(const std::filesystem::path& path);

/// The rigid transform of a position (m) and a quaternion of length 1, which may be off by 1 %;
/// nothing unless they are finite.
std::optional<Pose> rigid_pose(const Eigen::Vector3d& position, const detail::Quaternion& rotation);

/// The rigid transform nearest to 12 numbers (upper 3x4, row by row); nothing if they differ from
/// one by more than rounding.
std::optional<Pose> nearest_rigid(const double* rows);

}  // namespace dynains
