// Writers of simulated sequences: in the layout of SemanticKITTI, and as logs of ROS 2.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "simulation/simulator.hpp"

namespace dynains::simulation {

/// File name of scan i without extension, with at least six digits.
std::string scan_name(std::size_t i);

/// Writes velodyne/, labels/, calib.txt, times.txt and, as last file, poses.txt, so that a folder
/// with poses.txt is complete. poses.txt contains the noisy poses in camera axes (Tr in calib.txt,
/// as in KITTI). If poses are noisy, poses_true.txt contains the true poses. Creates the folder.
/// `progress(done, total)` is called after each scan. If it returns false, the call ends without
/// poses.txt. Returns whether the sequence is complete. Throws IoError.
bool write_sequence(Simulator& simulator, const std::filesystem::path& folder,
                    const std::function<bool(std::size_t, std::size_t)>& progress = {});

/// Writes MCAP: clouds on /points (sensor_msgs/msg/PointCloud2 in frame "lidar": float32 x y z
/// intensity, uint32 label, with a rolling shutter float32 time, s) and the noisy poses of "lidar"
/// in "map" on /tf (tf2_msgs/msg/TFMessage). The first scan has the time 0. `progress(done, total)`
/// is called after each scan. If it returns false, the call ends without a file. Returns whether
/// the file was written. Throws IoError.
bool write_log(Simulator& simulator, const std::filesystem::path& file,
               const std::function<bool(std::size_t, std::size_t)>& progress = {});

}  // namespace dynains::simulation
