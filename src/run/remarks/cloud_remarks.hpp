// Remarks on clouds that no option of the poses can heal.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dynains/config.hpp"
#include "dynains/io/recording.hpp"
#include "run/scan_range.hpp"

namespace dynains::run {

/// Remarks on a few scans of `range`: coordinates lie so far from the origin of the world that
/// float32 puts them into stripes; points of the first scan lie on a grid of 5 cm or more;
/// neighbouring clouds are equal, or more than a turn, though the sensor moves between them.
/// `seeks_ground`: also if no scan shows ground below the sensor, which a run finds if the sensor
/// is tilted by up to 45 deg. The remark names the mounting if ground is found under a larger tilt;
/// without any ground, as in a lift, there is none. Throws IoError.
std::vector<std::string> remarks_on_clouds(const Recording& recording, const ScanRange& range,
                                           bool seeks_ground);

/// Reads a few scans. Throws ConfigError if less than 1 % of their points are within `min_range`
/// and `max_range`, or, unless `unit_is_given`, if more than 90 % are farther than any LiDAR sees:
/// their coordinates are not in metres.
void check_ranges(const Recording& recording, const ScanRange& range, const RemoverConfig& config,
                  bool unit_is_given);

/// A remark if most of the scans begin a new window, because the time or distance from the scan
/// before is too large, or if there is only one.
std::optional<std::string> remark_on_lone_scans(const Recording& recording, const ScanRange& range,
                                                const RemoverConfig& config);

}  // namespace dynains::run
