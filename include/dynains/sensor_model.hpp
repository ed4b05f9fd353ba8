// What a scan tells about the sensor that took it: how far apart its beams are.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "dynains/points.hpp"

namespace dynains {

/// Angular sampling of a sensor, in degrees, and where it is mounted.
struct SensorModel {
  double azimuth_step = 0.0;        ///< median step between neighbours on one beam
  double elevation_gap = 0.0;       ///< 30th percentile of the vertical gap between beams
  double elevation_gap_wide = 0.0;  ///< 90th percentile of the same
  double elevation_min = 0.0;       ///< lowest beam
  double elevation_max = 0.0;       ///< highest beam

  double height = 0.0;              ///< m over the ground

  bool known() const { return azimuth_step > 0.0; }

  /// A 64-beam sensor on the roof of a car: what is assumed until a scan says more.
  static SensorModel typical() { return {0.2, 0.35, 0.6, -25.0, 5.0, 1.723}; }
};

/// Height of the sensor over the ground about it (m): the most common height of the lowest points
/// of one-metre cells near the sensor. 1.723 if hardly anything is near.
inline double estimate_height(PointsView points) {
  constexpr double kNear = 10.0;
  constexpr std::int32_t kCells = 2 * static_cast<std::int32_t>(kNear);
  constexpr float kNothing = std::numeric_limits<float>::infinity();
  std::vector<float> lowest(static_cast<std::size_t>(kCells * kCells), kNothing);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double column = std::floor(points.x[i] + kNear);
    const double row = std::floor(points.y[i] + kNear);
    if (!(column >= 0 && column < kCells && row >= 0 && row < kCells)) continue;
    float& low = lowest[static_cast<std::size_t>(row * kCells + column)];
    low = std::min(low, points.z[i]);
  }
  lowest.erase(std::remove(lowest.begin(), lowest.end(), kNothing), lowest.end());
  if (lowest.size() < 10) return SensorModel::typical().height;
  std::sort(lowest.begin(), lowest.end());
  // The densest interval of 0.3 m.
  std::size_t begin = 0, best_begin = 0, best_count = 0;
  for (std::size_t end = 0; end < lowest.size(); ++end) {
    while (lowest[end] - lowest[begin] > 0.3F) ++begin;
    if (end - begin + 1 > best_count) {
      best_count = end - begin + 1;
      best_begin = begin;
    }
  }
  return std::max(0.2, -static_cast<double>(lowest[best_begin + best_count / 2]));
}

/// Estimates the model from one scan (sensor frame). Unknown if there are fewer than 500 points.
/// Allocates; meant to be called once per sensor, not per scan.
inline SensorModel estimate_sensor_model(PointsView points) {
  constexpr std::size_t kFewest = 500;
  constexpr double kDegrees = 180.0 / M_PI;
  struct Direction {
    std::int32_t band;
    float along;
  };
  SensorModel model;
  if (points.size() < kFewest) return model;

  std::vector<float> azimuth(points.size());
  std::vector<float> elevation(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double x = points.x[i], y = points.y[i], z = points.z[i];
    azimuth[i] = static_cast<float>(std::atan2(y, x) * kDegrees);
    elevation[i] = static_cast<float>(std::atan2(z, std::hypot(x, y)) * kDegrees);
  }
  std::vector<float> sorted = elevation;
  const auto percentile = [](std::vector<float>& values, double share) {
    const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + at, values.end());
    return static_cast<double>(values[static_cast<std::size_t>(at)]);
  };
  model.height = estimate_height(points);
  model.elevation_min = percentile(sorted, 0.0005);
  model.elevation_max = percentile(sorted, 0.9995);

  // Gaps between neighbours within thin bands across the wanted direction; steps below a hundredth
  // of a degree are the same beam twice.
  const auto gaps_within = [&](const std::vector<float>& across, const std::vector<float>& along,
                               double band, double smallest) {
    std::vector<Direction> directions(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      directions[i] = {static_cast<std::int32_t>(std::floor(across[i] / band)), along[i]};
    }
    std::sort(directions.begin(), directions.end(), [](const Direction& a, const Direction& b) {
      return a.band != b.band ? a.band < b.band : a.along < b.along;
    });
    std::vector<float> gaps;
    for (std::size_t i = 1; i < directions.size(); ++i) {
      const float gap = directions[i].along - directions[i - 1].along;
      if (directions[i].band == directions[i - 1].band && static_cast<double>(gap) > smallest) {
        gaps.push_back(gap);
      }
    }
    return gaps;
  };
  std::vector<float> steps = gaps_within(elevation, azimuth, 0.1, 0.01);
  model.azimuth_step = steps.empty() ? 1.0 : std::clamp(percentile(steps, 0.5), 0.05, 2.0);
  std::vector<float> gaps = gaps_within(azimuth, elevation, model.azimuth_step, 0.08);
  model.elevation_gap = gaps.empty() ? 1.0 : std::clamp(percentile(gaps, 0.3), 0.1, 5.0);
  model.elevation_gap_wide = gaps.empty() ? 1.0 : std::clamp(percentile(gaps, 0.9), 0.1, 5.0);
  return model;
}

}  // namespace dynains
