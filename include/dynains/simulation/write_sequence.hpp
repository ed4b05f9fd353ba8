// Simulated sequences on disk, in the layout of SemanticKITTI.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "dynains/simulation/simulator.hpp"

namespace dynains::simulation {

/// Name of the files of scan i without extension, at least six digits.
std::string scan_name(std::size_t i);

/// Writes velodyne/, labels/, calib.txt, times.txt and, last, poses.txt, so that a folder with
/// poses is complete. poses.txt holds the noisy poses in camera axes (Tr in calib.txt, as in
/// KITTI); if poses are noisy, poses_true.txt holds the true ones.
/// `progress(done, total)` is called after each scan; returning false stops: poses.txt is then
/// missing. Creates the folder. Returns whether the sequence is complete. Throws IoError.
bool write_sequence(Simulator& simulator, const std::filesystem::path& folder,
                    const std::function<bool(std::size_t, std::size_t)>& progress = {});

}  // namespace dynains::simulation
