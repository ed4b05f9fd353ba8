// What a scan tells about the sensor that took it: how far apart its beams are.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/simd/arc_tangent.hpp"
#include "dynains/simd/wide_lanes.hpp"

namespace dynains {

/// Angular sampling of a sensor, in degrees, and where it is mounted.
struct SensorModel {
  double azimuth_step = 0.0;        ///< median step between neighbours on one beam
  double elevation_gap = 0.0;       ///< 30th percentile of the vertical gap between beams
  double elevation_gap_wide = 0.0;  ///< 90th percentile of the same
  double elevation_min = 0.0;       ///< lowest beam
  double elevation_max = 0.0;       ///< highest beam

  double height = 0.0;  ///< m over the ground

  /// From the frame of the sensor to one that looks where estimate_heading says; the beams are
  /// spaced alike in both.
  Eigen::Matrix3d R_headed_sensor = Eigen::Matrix3d::Identity();
  /// From there to the frame of a level sensor in its place, in which its points are handed on.
  Eigen::Matrix3d R_level_headed = Eigen::Matrix3d::Identity();

  Eigen::Matrix3d R_level_sensor() const { return R_level_headed * R_headed_sensor; }
  bool known() const { return azimuth_step > 0.0; }
  bool is_level() const { return R_level_headed.isIdentity(0.0); }

  /// A 64-beam sensor on the roof of a car: what is assumed until a scan says more.
  static SensorModel typical() {
    SensorModel model;
    model.azimuth_step = 0.2;
    model.elevation_gap = 0.35;
    model.elevation_gap_wide = 0.6;
    model.elevation_min = -25.0;
    model.elevation_max = 5.0;
    model.height = 1.723;
    return model;
  }
};

/// Estimates the sampling from one scan (sensor frame, finite coordinates); the height is that of a
/// typical sensor, see estimate_mounting. Unknown if there are fewer than 500 points, or none
/// beside another. Allocates; meant to be called once per sensor, not per scan.
inline SensorModel estimate_sensor_model(PointsView points) {
  constexpr std::size_t kFewest = 500;
  SensorModel model;
  if (points.size() < kFewest) return model;

  std::vector<float> azimuth(points.size() + detail::kMaxPackWidth);
  std::vector<float> elevation(points.size() + detail::kMaxPackWidth);
  static constexpr detail::PackConstant kDegrees(static_cast<float>(180.0 / M_PI));
  detail::for_packs(points.size(), [&](auto at) {
    const auto x = at.load(points.x.data());
    const auto y = at.load(points.y.data());
    const auto z = at.load(points.z.data());
    const auto range = sqrt(x * x + y * y);
    const auto distance = sqrt(range * range + z * z);
    (detail::azimuth_of(y, x, range) * kDegrees).store(&azimuth[at.begin]);
    (detail::elevation_of(z, range, distance) * kDegrees).store(&elevation[at.begin]);
  });
  azimuth.resize(points.size());
  elevation.resize(points.size());
  std::vector<float> sorted = elevation;
  const auto percentile = [](std::vector<float>& values, double share) {
    const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + at, values.end());
    return static_cast<double>(values[static_cast<std::size_t>(at)]);
  };
  model.height = SensorModel::typical().height;
  model.elevation_min = percentile(sorted, 0.0005);
  model.elevation_max = percentile(sorted, 0.9995);

  // Gaps between neighbours within thin bands across the wanted direction, in as many bands as hold
  // a quarter of the points; steps below a hundredth of a degree are the same beam twice.
  const auto gaps_within = [&](const std::vector<float>& across, const std::vector<float>& along,
                               double band, double smallest) {
    // Counting sort by band: angles lie within a half turn on either side.
    const auto band_of = [&](float angle) {
      return static_cast<std::size_t>((static_cast<double>(angle) + 181.0) / band);
    };
    std::vector<std::size_t> begin(band_of(181.0F) + 2, 0);
    for (const float angle : across) ++begin[band_of(angle) + 1];
    for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
    std::vector<float> by_band(along.size());
    std::vector<std::size_t> next = begin;
    for (std::size_t i = 0; i < along.size(); ++i) by_band[next[band_of(across[i])]++] = along[i];
    constexpr std::size_t kOneOf = 4;
    std::size_t looked_at = 0;
    std::vector<float> gaps;
    gaps.reserve(along.size());
    for (std::size_t i = 0; i + 1 < begin.size(); ++i) {
      if (looked_at * kOneOf > begin[i]) continue;
      looked_at += begin[i + 1] - begin[i];
      std::sort(&by_band[0] + begin[i], &by_band[0] + begin[i + 1]);
      for (std::size_t k = begin[i] + 1; k < begin[i + 1]; ++k) {
        const float gap = by_band[k] - by_band[k - 1];
        if (static_cast<double>(gap) > smallest) gaps.push_back(gap);
      }
    }
    return gaps;
  };
  std::vector<float> steps = gaps_within(elevation, azimuth, 0.1, 0.01);
  if (steps.empty()) return {};
  model.azimuth_step = std::clamp(percentile(steps, 0.5), 0.05, 2.0);
  std::vector<float> gaps = gaps_within(azimuth, elevation, model.azimuth_step, 0.08);
  model.elevation_gap = gaps.empty() ? 1.0 : std::clamp(percentile(gaps, 0.3), 0.1, 5.0);
  model.elevation_gap_wide = gaps.empty() ? 1.0 : std::clamp(percentile(gaps, 0.9), 0.1, 5.0);
  return model;
}

}  // namespace dynains
