// How far the beams of clouds go around.
#pragma once

#include <cstddef>

#include "dynains/io/recording.hpp"

namespace dynains {

/// Ratio of a turn by which the clouds of the scans `first` to `last` are more than one, so that
/// both ends show one place at two times; 0 if less than 1.5 deg, if they are de-skewed or of
/// several sensors, or if their points are not in the order of a turn. Throws IoError.
double overlap_of_turns(const Recording& recording, std::size_t first, std::size_t last);

}  // namespace dynains
