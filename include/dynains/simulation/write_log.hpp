// Simulated sequences as a log of ROS 2.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>

#include "dynains/simulation/simulator.hpp"

namespace dynains::simulation {

/// Writes an MCAP file: clouds on /points (sensor_msgs/PointCloud2 in frame "lidar": float32 x y z
/// intensity, uint32 label) and the noisy poses of "lidar" in "map" on /tf (tf2_msgs/TFMessage).
/// `progress(done, total)` is called after each scan; returning false stops: no file appears then.
/// Returns whether the file is complete. Throws IoError.
bool write_log(Simulator& simulator, const std::filesystem::path& file,
               const std::function<bool(std::size_t, std::size_t)>& progress = {});

}  // namespace dynains::simulation
