// How the times of points count: their unit and their origin.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"

namespace dynains {

/// Longest interval between the stamp of a scan and the time of one of its points, s.
inline constexpr double kMaxScan = 1.0;

/// Clock of the column `time`.
struct PointClock {
  double unit = 1.0;         ///< s per unit of the column
  bool is_absolute = false;  ///< times count from the origin of stamps, not from that of their scan
  double longest_scan = kMaxScan;  ///< s, between two points of one scan

  /// Seconds from `stamp`, s, to `time`, in the unit of the column.
  double after(double stamp, double time) const {
    return time * unit - (is_absolute ? stamp : 0.0);
  }
};

/// Times of the points of one scan that belong to the scan, in the unit of the column.
struct PointTimes {
  double first = 0.0;
  double last = -1.0;

  bool is_empty() const { return last < first; }
  bool holds(double time) const { return first <= time && time <= last; }
};

/// All finite times, if they are within `clock.longest_scan`. Else those of points with a return
/// that are within this interval of the median.
PointTimes times_of_scan(const RecordedScan& scan, const PointClock& clock);

/// Meaning of the times of points in a recording. Without a clock, `text` says why, or is empty if
/// the scans have too few points. With a clock, `text` is a warning for the user, or empty.
struct PointClockFinding {
  std::optional<PointClock> clock;
  std::string text;
};

/// Finds the clock in a sample of scans, by what most of their points with a return say. A scan
/// takes at most 1.5 times the interval between scans, and at least 5 % of it (or 5 ms, if scans
/// are farther apart than 0.1 s), so that one of s, ms, us and ns fits. If none does, times from 0
/// to 1 are shares of that interval, unless scans may be missing in between.
///
/// `times`: of the scans, s; `is_known`: whether they are measured. `unit`: s per unit of the
/// column; 0: to be found. `read(i)` gives scan i with raw times.
PointClockFinding find_clock(const std::vector<double>& times, bool is_known, double unit,
                             const std::function<const RecordedScan&(std::size_t)>& read);

}  // namespace dynains
