// Scans that differ from those beside them: cut off, or at the place of another one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"
#include "run/scan_range.hpp"

namespace dynains::run {

struct ScanCounts {
  std::uint64_t points = 0;
  std::uint64_t moving = 0;  ///< of the points
  bool fits = true;          ///< to earlier scans, so that the error of its motion is known

  double moving_share() const {
    return points == 0 ? 0.0 : static_cast<double>(moving) / static_cast<double>(points);
  }
};

/// The numbers of points of the scans in `range`, from the sizes of their files, which shows those
/// that were cut off. Throws IoError of the first, with the number of the others.
std::vector<ScanCounts> count_points(const Recording& recording, const ScanRange& range);

/// Scans with less than 60 % of the points of the scans before, less the factor by which these
/// vary: the pattern of some sensors does not repeat, and near obstacles take many points.
std::vector<std::size_t> thin_scans(const std::vector<ScanCounts>& counts);

/// Sentences about thin scans, and about scans whose surfaces do not lie where the poses place them
/// among those beside, though these agree. `counts`: of the scans from `first` on. `compares_all`:
/// else only scans are compared in which much more seems to move than in both beside, or which do
/// not fit as both do. Throws IoError.
std::vector<std::string> remarks_on_odd_scans(const Recording& recording, std::size_t first,
                                              const std::vector<ScanCounts>& counts,
                                              bool compares_all);

}  // namespace dynains::run
