// Scans whose points a run cannot judge, because their coordinates are not in metres.
#pragma once

#include "dynains/config.hpp"
#include "dynains/io/recording.hpp"
#include "scan_range.hpp"

namespace dynains::program {

/// Reads a few scans. Throws ConfigError if less than 1 % of their points are within `min_range`
/// and `max_range`, or, unless `unit_is_given`, if more than 90 % are farther than any LiDAR sees.
void check_ranges(const Recording& recording, const ScanRange& range, const RemoverConfig& config,
                  bool unit_is_given);

}  // namespace dynains::program
