// Writer of simulated sequences as logs of ROS 2.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>

#include "dynains/simulation/simulator.hpp"

namespace dynains::simulation {

/// Writes MCAP: clouds on /points (sensor_msgs/msg/PointCloud2 in frame "lidar": float32 x y z
/// intensity, uint32 label, with a rolling shutter float32 time, s) and the noisy poses of "lidar"
/// in "map" on /tf (tf2_msgs/msg/TFMessage). The first scan has the time 0. `progress(done, total)`
/// is called after each scan. If it returns false, the call ends without a file. Returns whether
/// the file was written. Throws IoError.
bool write_log(Simulator& simulator, const std::filesystem::path& file,
               const std::function<bool(std::size_t, std::size_t)>& progress = {});

}  // namespace dynains::simulation
