// Scans of sparse sensors, merged under a reading of the poses.
#pragma once

#include <cstddef>

#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// The number of consecutive scans whose points suffice for a registration: 1 for dense sensors, at
/// most 8.
std::size_t scans_to_merge(const Recording& recording);

/// Finite points (m, frame of scan `at`) of the scans `from` to `to` (inclusive), placed by the
/// given poses. Two sparse scans of a sensor that repeats no place meet different surfaces; merged
/// ones meet the same if the poses are right. Throws IoError.
PointBuffer merged_scans(const Recording& recording, std::size_t at, std::size_t from,
                         std::size_t to);

}  // namespace dynains
