// Whether the times by which scans were de-skewed are right.
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "dynains/io/recording.hpp"

namespace dynains {

/// Meanings of the times of points. All but the first are faults.
enum class PointTimesReading { kAsGiven, kNone, kReversed, kTwice, kHalf };

inline constexpr std::size_t kPointTimesReadings = 5;

/// Gap of pairs of de-skewed scans under each reading, m; see Agreement::gap.
struct PointTimesGaps {
  std::size_t pairs = 0;
  std::array<double, kPointTimesReadings> gap{};
  /// Pairs whose gap is clearly smaller than as given.
  std::array<std::size_t, kPointTimesReadings> better{};
};

/// Compares some scans `first` to `last` (inclusive) of a de-skewed recording with others that see
/// the same surfaces in other directions, at other times of their points.
PointTimesGaps point_times_gaps(const Recording& recording, std::size_t first, std::size_t last);

/// The reading under which scans agree clearly better than as given, or kAsGiven.
PointTimesReading best_reading(const PointTimesGaps& gaps);

/// How the times are read, and what to do; empty for kAsGiven.
std::string text_of(PointTimesReading reading);

}  // namespace dynains
