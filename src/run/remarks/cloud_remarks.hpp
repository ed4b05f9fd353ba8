// Remarks on clouds that no option of the poses can heal.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"
#include "run/scan_range.hpp"

namespace dynains::run {

/// A remark if coordinates lie so far from the origin of the world that float32 puts them into
/// stripes, or if the points of the first scan lie on a grid of 5 cm or more; another one if
/// neighbouring clouds are equal, or more than a turn, though the sensor moves between them. Reads
/// a few scans of `range`. Throws IoError.
std::vector<std::string> remarks_on_clouds(const Recording& recording, const ScanRange& range);

/// Advice if a few scans of `range` show no ground below the sensor, else nothing. A run finds the
/// ground if the sensor is tilted by up to 45 deg. The advice names the mounting if ground is found
/// under a larger tilt; without any ground, as in a lift, there is none. Throws IoError.
std::optional<std::string> remark_on_tilt(const Recording& recording, const ScanRange& range);

}  // namespace dynains::run
