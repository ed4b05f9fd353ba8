// Poses by the odometry: flags and the work that `dynains odometry` and `dynains run` share.
#pragma once

#include <CLI/CLI.hpp>

#include "run/estimate_poses.hpp"

namespace dynains::program {

/// Adds --no-deskew.
void add_compensated_flag(CLI::App& command, bool& is_compensated);

/// As estimate_poses(), with progress on standard error. Warns of directions that nothing
/// determines.
run::PoseEstimate estimate_with_progress(Recording& recording, const run::ScanWindow& window,
                                         bool one_thread, bool quiet);

void add_odometry_command(CLI::App& app);

}  // namespace dynains::program
