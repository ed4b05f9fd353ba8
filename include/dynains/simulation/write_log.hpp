// Writer of simulated sequences as logs of ROS.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>

#include "dynains/simulation/simulator.hpp"

namespace dynains::simulation {

/// Writes a log of the format of its name (.mcap or .db3: ROS 2, .bag: ROS 1): clouds on /points
/// (sensor_msgs/PointCloud2 in frame "lidar": float32 x y z intensity, uint32 label, with a rolling
/// shutter float32 time, s) and the noisy poses of "lidar" in "map" on /tf (tf2_msgs/TFMessage).
/// The first scan has the time 0, in a bag of ROS 1 the time 1 s. `progress(done, total)` is called
/// after each scan. If it returns false, the call ends without a file. Returns whether the file was
/// written. Throws IoError.
bool write_log(Simulator& simulator, const std::filesystem::path& file,
               const std::function<bool(std::size_t, std::size_t)>& progress = {});

}  // namespace dynains::simulation
