// The judgement of poses and clouds before the first scan of a run.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dynains/config.hpp"
#include "dynains/io/recording.hpp"
#include "run/scan_range.hpp"

namespace dynains::run {

/// Reads a few scans. Throws ConfigError if less than 1 % of their points are within `min_range`
/// and `max_range`, or, unless `unit_is_given`, if more than 90 % are farther than any LiDAR sees:
/// their coordinates are not in metres.
void check_ranges(const Recording& recording, const ScanRange& range, const RemoverConfig& config,
                  bool unit_is_given);

/// A remark for the user if most of the scans begin a new window,
/// because the time or distance from the scan before is too large, or if there is only one.
std::optional<std::string> remark_on_lone_scans(const Recording& recording, const ScanRange& range,
                                                const RemoverConfig& config);

struct StartCheck {
  std::vector<std::string> warnings;
  std::string refusal;  ///< why the run must not begin; empty: it may
};

/// Judges the poses, and the clouds of `range`. Poses of an odometry of this program, those of
/// fewer than eight scans, and all with `accepts_poses` are not judged. Throws IoError.
StartCheck check_start(const Recording& recording, const ScanRange& range,
                       const RemoverConfig& config, bool accepts_poses);

}  // namespace dynains::run
