// Remarks on clouds that no option of the poses can heal.
#pragma once

#include <optional>
#include <string>

#include "dynains/io/recording.hpp"
#include "dynains/sensor/mounting.hpp"
#include "scan_range.hpp"

namespace dynains::program {

/// A remark if coordinates lie so far from the origin of the world that float32 puts them into
/// stripes, or if the points of the first scan lie on a grid of 5 cm or more. Throws IoError.
std::optional<std::string> remark_on_stripes(const Recording& recording);

/// A remark if neighbouring clouds are equal, though the sensor moves between them. Reads a few
/// scans. Throws IoError.
std::optional<std::string> remark_on_copies(const Recording& recording, const ScanRange& range);

/// A remark on a sensor that no scan shows upright or upside down, up to 45 deg: the mounting under
/// which there is ground below it, or that none was found. Empty if `mounting` is known. Throws
/// IoError.
std::optional<std::string> remark_on_mounting(const Recording& recording, const Mounting& mounting);

/// The mounting under which there is ground below the sensor, if it is tilted by more than the 45
/// deg up to which a run finds it. Reads a few scans of `range`. Throws IoError.
std::optional<std::string> remark_on_tilted_scans(const Recording& recording,
                                                  const ScanRange& range);

}  // namespace dynains::program
