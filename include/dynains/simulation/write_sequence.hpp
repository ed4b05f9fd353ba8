// Writer of simulated sequences in the layout of SemanticKITTI.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "dynains/simulation/simulator.hpp"

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

}  // namespace dynains::simulation
