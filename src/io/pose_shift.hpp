// Whether poses belong to other scans than those they were given for.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace dynains {

/// Scans by which poses are shifted on trial, to either side.
inline constexpr int kFarthestShift = 3;

/// How far two scans lie apart where they should agree (Agreement::gap, m), if their poses are
/// those of the scans 3 before, ..., 3 behind: the poses as they are given stand in the middle.
using ShiftedGaps = std::array<double, 2 * kFarthestShift + 1>;

/// Fewer pairs of scans than these prove nothing.
inline constexpr std::size_t kLeastShiftPairs = 8;

/// The shift of at most 2 scans under which pairs of scans agree better, beyond doubt; 0 if there
/// is none.
int best_shift(const std::vector<ShiftedGaps>& pairs);

}  // namespace dynains
