// Remarks on clouds that no option of the poses can heal, and on scans that differ from those
// beside them: cut off, or at the place of another one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dynains/config.hpp"
#include "dynains/io/recording.hpp"
#include "run/scan_range.hpp"

namespace dynains::run {

/// Remarks on a few scans of `range`: coordinates lie so far from the origin of the world that
/// float32 puts them into stripes; points of the first scan lie on a grid of 5 cm or more;
/// neighbouring clouds are equal, or more than a turn, though the sensor moves between them.
/// `seeks_ground`: also if no scan shows ground below the sensor, which a run finds if the sensor
/// is tilted by up to 45 deg. The remark names the mounting if ground is found under a larger tilt;
/// without any ground, as in a lift, there is none. Throws IoError.
std::vector<std::string> remarks_on_clouds(const Recording& recording, const ScanRange& range,
                                           bool seeks_ground);

/// Reads a few scans. Throws ConfigError if less than 1 % of their points are within `min_range`
/// and `max_range`, or, unless `unit_is_given`, if more than 90 % are farther than any LiDAR sees:
/// their coordinates are not in metres.
void check_ranges(const Recording& recording, const ScanRange& range, const RemoverConfig& config,
                  bool unit_is_given);

/// A remark if most of the scans begin a new window, because the time or distance from the scan
/// before is too large, or if there is only one.
std::optional<std::string> remark_on_lone_scans(const Recording& recording, const ScanRange& range,
                                                const RemoverConfig& config);

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
