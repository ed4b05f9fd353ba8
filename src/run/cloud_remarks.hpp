// What the clouds of a recording tell, poses apart.
#pragma once

#include <optional>
#include <string>

#include "dynains/config.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/sensor/mounting.hpp"
#include "scan_range.hpp"

namespace dynains::program {

/// A remark if coordinates lie so far from the origin of the world that float32 puts them into
/// stripes, or if the points of the first scan lie on a grid of 5 cm or more. Throws IoError.
std::optional<std::string> remark_on_stripes(const Recording& recording);

/// A remark on a sensor that no scan shows upright or upside down, up to 45 deg: the mounting under
/// which there is ground below it, or that none was found. Empty if `mounting` is known. Throws
/// IoError.
std::optional<std::string> remark_on_mounting(const Recording& recording, const Mounting& mounting);

/// The mounting under which there is ground below the sensor, if it is tilted by more than the 45
/// deg up to which a run finds it. Reads a few scans of `range`. Throws IoError.
std::optional<std::string> remark_on_tilted_scans(const Recording& recording,
                                                  const ScanRange& range);

/// A remark if most of the scans of `range` begin a new window, because the time or distance from
/// the scan before is too large, or if there is only one.
std::optional<std::string> remark_on_lone_scans(const Recording& recording, const ScanRange& range,
                                                const RemoverConfig& config);

/// Reads a few scans. Throws ConfigError if less than 1 % of their points are within `min_range`
/// and `max_range`, or, unless `unit_is_given`, if more than 90 % are farther than any LiDAR sees.
void check_ranges(const Recording& recording, const ScanRange& range, const RemoverConfig& config,
                  bool unit_is_given);

/// OwnBody::min_range() of a sample of the scans of `range`, m, at most `otherwise`; that value if
/// the sensor moves less than 5 m or the scans are too few to tell. A body that reaches farther is
/// judged like other things; otherwise the road around it would be lost. Throws IoError.
double own_body_range(const Recording& recording, const ScanRange& range, double otherwise);

}  // namespace dynains::program
