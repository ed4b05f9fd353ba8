// RemoverConfig::min_range of a recording, by what its sensor sees of its own body.
#pragma once

#include "dynains/io/recording.hpp"
#include "scan_range.hpp"

namespace dynains::program {

/// OwnBody::min_range() of a sample of the scans of `range`, m, at most `otherwise`; that value if
/// the sensor moves less than 5 m or the scans are too few to tell. A body that reaches farther is
/// judged like other things; otherwise the road around it would be lost. Throws IoError.
double own_body_range(const Recording& recording, const ScanRange& range, double otherwise);

}  // namespace dynains::program
