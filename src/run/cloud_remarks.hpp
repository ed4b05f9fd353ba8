// Remarks on clouds that no option of the poses can heal.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"
#include "scan_range.hpp"

namespace dynains::program {

/// A remark if coordinates lie so far from the origin of the world that float32 puts them into
/// stripes, or if the points of the first scan lie on a grid of 5 cm or more; another one if
/// neighbouring clouds are equal, though the sensor moves between them. Reads a few scans of
/// `range`. Throws IoError.
std::vector<std::string> remarks_on_clouds(const Recording& recording, const ScanRange& range);

/// What to do if a few scans of `range` have no ground below the sensor: the mounting under which
/// there is some, beyond the 45 deg up to which a run finds it, or the options. Throws IoError.
std::optional<std::string> remark_on_tilt(const Recording& recording, const ScanRange& range);

}  // namespace dynains::program
