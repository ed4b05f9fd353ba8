// Statistics of scans, to compare simulated with real ones.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"

namespace dynains::simulation {

/// Collects scan after scan.
class ScanStatistics {
 public:
  /// Outer limits of the range bins, m; the last bin is open.
  static constexpr std::array<double, 6> kRangeLimits{5, 10, 20, 30, 50, 80};
  /// Distances at which the points of a car are counted, within +-15 %, m.
  static constexpr std::array<double, 3> kCarRanges{10, 20, 40};

  /// `xyzi` interleaved, sensor frame, z about upwards; `labels` SemanticKITTI, or empty.
  /// Throws CloudError if there are not as many labels as points.
  void add(Span<const float> xyzi, Span<const std::uint32_t> labels);

  double points_per_scan() const;
  /// Share of all points in each range bin.
  std::array<double, kRangeLimits.size() + 1> range_shares() const;
  /// Share of points less than 0.2 m above the lowest point within about 1.5 m, where that lies
  /// well below the sensor. Needs no labels, so it means the same on every recording.
  double ground_share() const;
  /// Share of labelled points that are moving (classes 252 to 259).
  double moving_share() const;
  /// Median number of points of a car (10, 252) around each of kCarRanges; 0 if there is none.
  std::array<double, kCarRanges.size()> points_per_car() const;
  /// Number of cars behind each median.
  std::array<std::size_t, kCarRanges.size()> cars() const;

 private:
  std::size_t scans_ = 0, points_ = 0, ground_ = 0, moving_ = 0;
  std::array<std::size_t, kRangeLimits.size() + 1> ranges_{};
  std::array<std::vector<std::size_t>, kCarRanges.size()> car_points_;
};

}  // namespace dynains::simulation
