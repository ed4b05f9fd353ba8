// RemoverConfig::min_range of a recording, by what its sensor sees of its own body.
#pragma once

#include "dynains/io/recording.hpp"
#include "scan_range.hpp"

namespace dynains::program {

/// OwnBody::min_range() of a sample of the scans of `range`, m; `otherwise` if the sensor moves
/// less than 5 m or the scans are too few to tell. Throws IoError.
double own_body_range(const Recording& recording, const ScanRange& range, double otherwise);

}  // namespace dynains::program
