// Poses of a recording without poses, by the odometry.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"
#include "run_timing.hpp"
#include "scan_range.hpp"

namespace dynains::run {

/// The odometry lost track; results of the scans before it are complete.
struct LostTrack : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Findings of the odometry about a recording.
struct PoseEstimate {
  /// Where and why the odometry lost track, one sentence; empty: it did not.
  std::optional<std::string> loss;
  /// Scans that fit to none before, though later ones do: their motion is the predicted one.
  std::vector<std::size_t> lost_scans;
  /// Scans whose surfaces do not determine all directions of motion.
  std::size_t uncertain_scans = 0;
  RunTiming timing;  ///< began_epoch and plausibility of the scans
};

/// Gives poses to the scans in `window`, up to the last one that the odometry does not lose, and
/// leaves out the others. The first scan is the world frame. Calls `progress(done, total)` before
/// the first scan and after each; a signal ends the command. `one_thread`: this thread also reads.
/// Throws IoError, ConfigError for a window with fewer than two scans, LostTrack if fewer have
/// poses, and Interrupted.
PoseEstimate estimate_poses(Recording& recording, const ScanWindow& window, bool one_thread,
                            const std::function<void(std::size_t, std::size_t)>& progress);

/// Writes "time x y z qx qy qz qw" for each scan, below a line with the fingerprint of these rows.
/// Throws IoError.
void write_trajectory(const std::filesystem::path& file, const Recording& recording);

/// Whether write_trajectory() has written the file as it is. Throws IoError.
bool is_own_trajectory(const std::filesystem::path& file);

}  // namespace dynains::run
