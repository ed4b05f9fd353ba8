// Statistics of scans, for the comparison of simulated and real scans.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"

namespace dynains::simulation {

/// Accumulates statistics over scans.
class ScanStatistics {
 public:
  /// Upper limits of the range bins, m. A further bin has no upper limit.
  static constexpr std::array<double, 6> kRangeLimits{5, 10, 20, 30, 50, 80};
  /// Ranges for points_per_car(), m, with a tolerance of 15 %.
  static constexpr std::array<double, 3> kCarRanges{10, 20, 40};

  /// Adds one scan. `xyzi`: interleaved, m, sensor frame, z approximately up. `labels`:
  /// SemanticKITTI labels by point, or empty. Throws CloudError if the numbers of points and labels
  /// differ.
  void add(Span<const float> xyzi, Span<const std::uint32_t> labels);

  double points_per_scan() const;
  /// Ratio of points in each range bin, [0, 1].
  std::array<double, kRangeLimits.size() + 1> range_shares() const;
  /// Ratio of points less than 0.2 m above the lowest point within about 1.5 m, if that point lies
  /// well below the sensor, [0, 1]. It does not use labels, so it is comparable between all
  /// recordings.
  double ground_share() const;
  /// Ratio of points with a moving class (252 to 259), [0, 1].
  double moving_share() const;
  /// Median number of points of a car (classes 10 and 252) at each of kCarRanges; 0 without cars.
  std::array<double, kCarRanges.size()> points_per_car() const;
  /// Number of cars in each median of points_per_car().
  std::array<std::size_t, kCarRanges.size()> cars() const;

 private:
  std::size_t scans_ = 0, points_ = 0, ground_ = 0, moving_ = 0;
  std::array<std::size_t, kRangeLimits.size() + 1> ranges_{};
  std::array<std::vector<std::size_t>, kCarRanges.size()> car_points_;
};

}  // namespace dynains::simulation
