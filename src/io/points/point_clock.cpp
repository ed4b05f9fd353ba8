#include "point_clock.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "../poses/kitti_files.hpp"
#include "../text.hpp"
#include "dynains/median.hpp"
#include "finite_points.hpp"

namespace dynains {
namespace {

constexpr double kUnits[] = {1.0, 1e-3, 1e-6, 1e-9};
constexpr double kNoGap = 0.125;  // s; scans that are farther apart may be some of all scans

/// Calls `take(xyz, time)` for the points with a return and a finite time, in their order.
template <class Take>
void for_each_time(const RecordedScan& scan, Take&& take) {
  for (std::size_t k = 0; k < scan.time.size(); ++k) {
    const float* const xyz = scan.xyzi.data() + 4 * k;
    if (std::isfinite(scan.time[k]) && is_measured(xyz)) take(xyz, scan.time[k]);
  }
}

struct DirectedTime {
  float azimuth;  // rad
  double time;
};

/// Whether most neighbours are more than a tenth of `span` apart: 0.8 of them if times are random.
bool do_leap(const std::vector<DirectedTime>& times, double span) {
  std::size_t leaps = 0;
  for (std::size_t k = 1; k < times.size(); ++k) {
    leaps += std::abs(times[k].time - times[k - 1].time) > 0.1 * span ? 1 : 0;
  }
  return times.size() >= 100 && 2 * leaps > times.size() - 1;
}

/// Whether no sector of 30 deg is empty.
bool are_all_around(const std::vector<DirectedTime>& by_direction) {
  constexpr float kSector = 3.1415927F / 6.0F;
  float before = -3.1415927F;
  for (const DirectedTime& one : by_direction) {
    if (one.azimuth - before > kSector) return false;
    before = one.azimuth;
  }
  return !by_direction.empty() && 3.1415927F - before <= kSector;
}

PointTimes range_of(const std::vector<double>& times, double least, double most) {
  PointTimes range{std::numeric_limits<double>::infinity(),
                   -std::numeric_limits<double>::infinity()};
  for (const double time : times) {
    if (!(least <= time && time <= most)) continue;
    range.first = std::min(range.first, time);
    range.last = std::max(range.last, time);
  }
  return range;
}

/// Finds the clock of points from the times in some scans.
class PointClockSearch {
 public:
  /// `period`: median time from scan to scan, s; 0: not known. `unit`: as of find_clock().
  PointClockSearch(double period, double unit) : period_(period), unit_(unit) {}

  void add(const RecordedScan& scan) {
    Sample sample;
    std::vector<DirectedTime> times;
    for_each_time(scan, [&](const float* xyz, double time) {
      sample.times.push_back(time);
      times.push_back({std::atan2(xyz[1], xyz[0]), time});
    });
    if (times.empty()) return;
    std::sort(sample.times.begin(), sample.times.end());
    const double span = sample.quantile(0.95) - sample.quantile(0.05);
    const bool do_points_leap = do_leap(times, span);
    std::sort(times.begin(), times.end(),
              [](const DirectedTime& a, const DirectedTime& b) { return a.azimuth < b.azimuth; });
    // Times follow the order of the points in files of drivers, the azimuth for a spinning sensor.
    sample.is_random = do_points_leap && do_leap(times, span);
    sample.is_all_around = are_all_around(times);
    points_ += sample.times.size();
    samples_.push_back(std::move(sample));
  }

  PointClockFinding result() const {
    if (samples_.empty()) return {std::nullopt, "found no point with a return and a finite time"};
    const std::string option =
        "; give the unit with --point-time-unit: s, ms, us, ns, or seconds, such as 0.1 for times "
        "from 0 to 1 in scans of 0.1 s";
    constexpr std::size_t kFewPoints = 3;  // in a scan; they may have one time by chance
    if (duration(1.0) == 0.0) {
      if (points_ <= kFewPoints * samples_.size()) return {};
      return {std::nullopt, "expected times that differ from point to point, found " + found()};
    }
    const std::optional<double> unit = find_unit();
    if (!unit) {
      return {std::nullopt,
              "expected times in s, ms, us or ns that fit the interval of scans, found " + found() +
                  option};
    }
    PointClock clock;
    clock.unit = *unit;
    clock.longest_scan = longest_scan();
    const Sample& sample = samples_[samples_.size() / 2];
    // Times of more than 10 s count from the origin of stamps.
    clock.is_absolute = std::abs(clock.unit * sample.median()) > 10.0;
    std::string text;
    const auto add = [&](const std::string& remark) {
      if (!remark.empty()) text += (text.empty() ? "" : "; ") + remark;
    };
    if (clock.unit == period_ && !(unit_ > 0.0) && is_share()) {
      add("times of points from 0 to 1 count as shares of a scan of " + text::rounded(period_, 6) +
          " s");
    }
    const std::string outside = outside_text(clock.unit);
    if (!outside.empty()) add(outside + ": they keep their place");
    add(random_text());
    add(duration_text(clock.unit));
    return {clock, text};
  }

 private:
  /// One scan of the sample.
  struct Sample {
    std::vector<double> times;   ///< of points with a return, ascending
    bool is_random = false;      ///< times follow neither the order nor the direction of points
    bool is_all_around = false;  ///< points lie in all directions

    double quantile(double share) const {
      const double rank = std::round(share * static_cast<double>(times.size() - 1));
      return times[static_cast<std::size_t>(rank)];
    }
    double median() const { return quantile(0.5); }
  };

  /// A unit that is given decides alone, also for scans that overlap.
  double longest_scan() const {
    const bool is_known = period_ > 0.0 && !(unit_ > 0.0);
    return is_known ? std::min(kMaxScan, 1.5 * period_) : kMaxScan;
  }

  double shortest_scan() const {
    const double period = period_ > 0.0 ? std::min(period_, kKittiPeriod) : kKittiPeriod;
    return 0.05 * period;
  }

  /// Points whose time is farther from the median of their scan than a scan takes.
  std::size_t count_outside(double unit) const {
    const double longest = longest_scan() / unit;
    std::size_t inside = 0;
    for (const Sample& sample : samples_) {
      const double middle = sample.median();
      const auto first =
          std::lower_bound(sample.times.begin(), sample.times.end(), middle - longest);
      const auto last = std::upper_bound(first, sample.times.end(), middle + longest);
      inside += static_cast<std::size_t>(last - first);
    }
    return points_ - inside;
  }

  /// Time that the middle 90 % of the points of a scan take, s.
  double duration(double unit) const {
    std::vector<double> durations;
    for (const Sample& sample : samples_) {
      durations.push_back(unit * (sample.quantile(0.95) - sample.quantile(0.05)));
    }
    return median(std::move(durations));
  }

  /// Whether times look like shares of a scan, from 0 to 1.
  bool is_share() const {
    return std::all_of(samples_.begin(), samples_.end(), [](const Sample& sample) {
      return sample.quantile(0.01) >= 0.0 && sample.quantile(0.99) <= 1.0 &&
             sample.quantile(0.95) > 0.85;
    });
  }

  std::optional<double> find_unit() const {
    // Scans with a given unit may have more garbage.
    const auto fits = [this](double unit) { return 10 * count_outside(unit) <= points_; };
    if (unit_ > 0.0) {
      return 2 * count_outside(unit_) < points_ ? std::optional<double>(unit_) : std::nullopt;
    }
    const auto unit = std::find_if(std::begin(kUnits), std::end(kUnits), fits);
    const bool is_plausible = unit != std::end(kUnits) && duration(*unit) >= shortest_scan();
    if (!is_share()) return is_plausible ? std::optional<double>(*unit) : std::nullopt;
    // Seconds of a slow sensor, or shares of a scan.
    if (is_plausible && *unit == 1.0) return std::nullopt;
    if (is_plausible) return *unit;
    if (period_ > 0.0 && period_ <= kNoGap) return period_;
    return std::nullopt;
  }

  /// "0 to 0.0997 (quantiles ...)", the values of a scan in the middle of the sample.
  std::string found() const {
    const Sample& sample = samples_[samples_.size() / 2];
    std::string text = "times of points from " + text::to_text(sample.quantile(0.05)) + " to " +
                       text::to_text(sample.quantile(0.95)) +
                       " (without the first and the last 5 %)";
    return period_ > 0.0 ? text + " in scans that are " + text::rounded(period_, 6) + " s apart"
                         : text;
  }

  std::string outside_text(double unit) const {
    const std::size_t outside = count_outside(unit);
    if (outside == 0) return {};
    const Sample& sample = samples_[samples_.size() / 2];
    return std::to_string(outside) + " of " + std::to_string(points_) + " points in " +
           std::to_string(samples_.size()) +
           " scans have times that cannot be those of their scan (" +
           text::to_text(sample.times.front()) + " to " + text::to_text(sample.times.back()) +
           ", with the median " + text::to_text(sample.median()) + ")";
  }

  bool do_most(bool Sample::*property) const {
    const auto count = std::count_if(samples_.begin(), samples_.end(),
                                     [&](const Sample& sample) { return sample.*property; });
    return 2 * static_cast<std::size_t>(count) > samples_.size();
  }

  std::string random_text() const {
    if (!do_most(&Sample::is_random)) return {};
    return "times of points follow neither the order of the points nor their direction, as garbage "
           "does; if they are none, the points were sorted";
  }

  /// A remark on scans that take another time than the sensor has from scan to scan.
  std::string duration_text(double unit) const {
    const double whole = duration(unit) / 0.9;  // duration() is that of the middle 90 %
    const bool is_long = whole > 1.15 * period_;
    // Every second scan of a sensor may have been recorded.
    const bool is_short =
        do_most(&Sample::is_all_around) && period_ <= kNoGap && whole < 0.45 * period_;
    if (!(period_ > 0.0) || !(is_long || is_short)) return {};
    return "times of points in units of " + text::to_text(unit) + " s give a scan " +
           (is_short ? "all around " : "") + "that takes " + text::rounded(whole, 6) +
           " s, but scans are " + text::rounded(period_, 6) +
           " s apart: see --point-time-unit for another unit";
  }

  double period_;
  double unit_;
  std::size_t points_ = 0;  ///< of all samples
  std::vector<Sample> samples_;
};

}  // namespace

PointTimes times_of_scan(const RecordedScan& scan, const PointClock& clock) {
  const double finite = std::numeric_limits<double>::max();
  const double longest = clock.longest_scan / clock.unit;
  const PointTimes all = range_of(scan.time, -finite, finite);
  if (all.is_empty() || all.last - all.first <= longest) return all;
  std::vector<double> times;
  for_each_time(scan, [&](const float*, double time) { times.push_back(time); });
  if (times.empty()) return {};
  const double middle = median(times);
  return range_of(times, middle - longest, middle + longest);
}

PointClockFinding find_clock(const std::vector<double>& times, bool is_known, double unit,
                             const std::function<const RecordedScan&(std::size_t)>& read) {
  constexpr std::size_t kSamples = 5;
  std::vector<double> periods;
  for (std::size_t i = 1; i < times.size(); ++i) periods.push_back(times[i] - times[i - 1]);
  PointClockSearch search(is_known ? median(std::move(periods)) : 0.0, unit);
  const std::size_t count = std::min(kSamples, times.size());
  for (std::size_t k = 0; k < count; ++k) {
    search.add(read(count == 1 ? 0 : k * (times.size() - 1) / (count - 1)));
  }
  return search.result();
}

}  // namespace dynains
