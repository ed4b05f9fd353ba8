// How the times of points count: their unit and their origin.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/median.hpp"

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

/// Finds the clock by what most points with a return of some scans say. A scan takes at most 1.5
/// times the interval between scans, and at least 5 % of it (or 5 ms, if scans are farther apart
/// than 0.1 s), so that one of s, ms, us and ns fits. If none does, times from 0 to 1 are shares of
/// that interval, unless scans may be missing in between.
class PointClockSearch {
 public:
  /// `period`: median time from scan to scan, s; 0: not known. `unit`: s per unit of the column; 0:
  /// to be found.
  PointClockSearch(double period, double unit) : period_(period), unit_(unit) {}

  /// `scan`: with raw times. `stamp`: time of the scan, s.
  void add(double stamp, const RecordedScan& scan);
  PointClockFinding result() const;

 private:
  /// One scan of the sample.
  struct Sample {
    double stamp;
    std::vector<double> times;   ///< of points with a return, ascending
    bool is_random = false;      ///< times follow neither the order nor the direction of points
    bool is_all_around = false;  ///< points lie in all directions

    double quantile(double share) const;
    double median() const { return quantile(0.5); }
  };

  double longest_scan() const;
  double shortest_scan() const;
  std::size_t count_outside(double unit) const;
  double duration(double unit) const;
  bool is_share() const;
  std::optional<double> find_unit() const;
  std::string found() const;
  std::string outside_text(double unit) const;
  std::string random_text() const;
  std::string duration_text(double unit) const;
  bool do_most(bool Sample::*property) const;

  double period_;
  double unit_;
  std::size_t points_ = 0;  ///< of all samples
  std::vector<Sample> samples_;
};

/// Searches the clock in a sample of scans. `times`: of the scans, s; `is_known`: whether they are
/// measured. `unit`: as in PointClockSearch. `read(i)` gives scan i with raw times.
template <class Read>
PointClockFinding find_clock(const std::vector<double>& times, bool is_known, double unit,
                             Read&& read) {
  constexpr std::size_t kSamples = 5;
  std::vector<double> periods;
  for (std::size_t i = 1; i < times.size(); ++i) periods.push_back(times[i] - times[i - 1]);
  PointClockSearch search(is_known ? median(std::move(periods)) : 0.0, unit);
  const std::size_t count = std::min(kSamples, times.size());
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = count == 1 ? 0 : k * (times.size() - 1) / (count - 1);
    search.add(times[i], read(i));
  }
  return search.result();
}

}  // namespace dynains
