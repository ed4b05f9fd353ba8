// Detection of poses that are shifted by some scans.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace dynains {

/// Largest shift that is tried, in both directions, scans.
inline constexpr int kFarthestShift = 3;

/// Agreement::gap (m) of two scans under poses shifted by -3 to 3 scans; the middle value belongs
/// to the poses as given.
using ShiftedGaps = std::array<double, 2 * kFarthestShift + 1>;

/// Smallest number of pairs for a decision.
inline constexpr std::size_t kLeastShiftPairs = 8;

/// The shift, at most 2 scans, under which pairs agree significantly better; 0 if there is none.
int best_shift(const std::vector<ShiftedGaps>& pairs);

}  // namespace dynains
