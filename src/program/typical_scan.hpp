// The scan that memory is reserved by.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "dynains/io/recording.hpp"
#include "run_results.hpp"

namespace dynains::program {

/// Index of the scan with the median number of points among up to 15 scans, evenly spread over
/// `range`: one scan that is much larger than the others is never chosen from three or more. Reads
/// headers only. Throws IoError.
inline std::size_t typical_scan(const Recording& recording, const ScanRange& range) {
  constexpr std::size_t kMaxSampled = 15;
  const std::size_t count = std::min(range.size(), kMaxSampled);
  std::vector<std::pair<std::uint64_t, std::size_t>> points_and_scan(count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = range.first + k * range.size() / count;
    points_and_scan[k] = {recording.point_count(i), i};
  }
  std::sort(points_and_scan.begin(), points_and_scan.end());
  // The lower of two medians: of two scans, the smaller one.
  return points_and_scan[(count - 1) / 2].second;
}

}  // namespace dynains::program
