// Angular sampling and mounting of a sensor; estimate of the sampling from one scan.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains {

/// Angular sampling of a sensor (deg), and its mounting.
struct SensorModel {
  double azimuth_step = 0.0;        ///< median step between consecutive returns of one beam
  double elevation_gap = 0.0;       ///< 30th percentile of the gaps between beams
  double elevation_gap_wide = 0.0;  ///< 90th percentile of these gaps
  double elevation_min = 0.0;       ///< elevation of the lowest beam
  double elevation_max = 0.0;       ///< elevation of the highest beam

  double height = 0.0;  ///< m above the ground

  /// Rotation about z from the sensor frame to the headed frame, whose x axis has the azimuth
  /// estimate_heading().
  Eigen::Matrix3d R_headed_sensor = Eigen::Matrix3d::Identity();
  /// Rotation from the headed frame to the level frame, the frame of all stages. Identity for a
  /// sensor without tilt.
  Eigen::Matrix3d R_level_headed = Eigen::Matrix3d::Identity();

  Eigen::Matrix3d R_level_sensor() const {
    return detail::composed(R_level_headed, R_headed_sensor);
  }
  bool known() const { return azimuth_step > 0.0; }
  bool is_level() const { return R_level_headed.isIdentity(0.0); }

  /// Model of a 64-beam sensor on the roof of a car, the default until there is an estimate.
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

namespace detail {

/// By point: azimuth and elevation, deg.
struct BeamAngles {
  std::vector<float> azimuth, elevation;
};

inline BeamAngles beam_angles(PointsView points) {
  BeamAngles angles;
  angles.azimuth.resize(points.size() + kMaxPackWidth);
  angles.elevation.resize(points.size() + kMaxPackWidth);
  static constexpr PackConstant kDegrees(static_cast<float>(180.0 / M_PI));
  for_packs(points.size(), [&](auto at) {
    const auto x = at.load(points.x.data());
    const auto y = at.load(points.y.data());
    const auto z = at.load(points.z.data());
    const auto range = sqrt(x * x + y * y);
    const auto distance = sqrt(range * range + z * z);
    (azimuth_of(y, x, range) * kDegrees).store(&angles.azimuth[at.begin]);
    (elevation_of(z, range, distance) * kDegrees).store(&angles.elevation[at.begin]);
  });
  angles.azimuth.resize(points.size());
  angles.elevation.resize(points.size());
  return angles;
}

/// The value above the ratio `ratio` ([0, 1]) of the other values. Reorders `values`, which must
/// not be empty.
inline double percentile(std::vector<float>& values, double ratio) {
  const auto at = static_cast<std::ptrdiff_t>(ratio * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return static_cast<double>(values[static_cast<std::size_t>(at)]);
}

/// Gaps (deg) larger than `smallest` (deg) between consecutive values of the angle `along`, within
/// each band of the angle `across` of width `band` (deg). Skips bands: sorts only about a quarter
/// of the points.
inline std::vector<float> gaps_within_bands(const std::vector<float>& across,
                                            const std::vector<float>& along, double band,
                                            double smallest) {
  // Counting sort by band; angles lie in [-180, 180].
  const auto band_of = [&](float angle) {
    return static_cast<std::size_t>((static_cast<double>(angle) + 181.0) / band);
  };
  std::vector<std::size_t> begin(band_of(181.0F) + 2, 0);
  for (const float angle : across) ++begin[band_of(angle) + 1];
  for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
  std::vector<float> by_band(along.size());
  std::vector<std::size_t> next = begin;
  for (std::size_t i = 0; i < along.size(); ++i) by_band[next[band_of(across[i])]++] = along[i];

  constexpr std::size_t kPointsPerSorted = 4;
  std::size_t sorted = 0;
  std::vector<float> gaps;
  gaps.reserve(along.size());
  for (std::size_t i = 0; i + 1 < begin.size(); ++i) {
    if (sorted * kPointsPerSorted > begin[i]) continue;
    sorted += begin[i + 1] - begin[i];
    std::sort(&by_band[0] + begin[i], &by_band[0] + begin[i + 1]);
    for (std::size_t k = begin[i] + 1; k < begin[i + 1]; ++k) {
      const float gap = by_band[k] - by_band[k - 1];
      if (static_cast<double>(gap) > smallest) gaps.push_back(gap);
    }
  }
  return gaps;
}

}  // namespace detail

/// Estimates the angular sampling from one scan (m, sensor frame, finite coordinates). Sets the
/// height of SensorModel::typical(); estimate_mounting() estimates the height. The result is not
/// known() if the scan has fewer than 500 points, or no two points on one beam. Allocates memory,
/// so call it for one scan of a sensor, not for each.
inline SensorModel estimate_sensor_model(PointsView points) {
  constexpr std::size_t kFewest = 500;
  if (points.size() < kFewest) return {};
  const detail::BeamAngles angles = detail::beam_angles(points);
  SensorModel model;
  model.height = SensorModel::typical().height;
  std::vector<float> elevation = angles.elevation;
  model.elevation_min = detail::percentile(elevation, 0.0005);
  model.elevation_max = detail::percentile(elevation, 0.9995);

  constexpr double kBeamBand = 0.1;    // deg, range of the elevations of one beam
  constexpr double kLeastStep = 0.01;  // deg
  constexpr double kLeastGap = 0.08;   // deg, between beams
  std::vector<float> steps =
      detail::gaps_within_bands(angles.elevation, angles.azimuth, kBeamBand, kLeastStep);
  if (steps.empty()) return {};
  model.azimuth_step = std::clamp(detail::percentile(steps, 0.5), 0.05, 2.0);
  std::vector<float> gaps =
      detail::gaps_within_bands(angles.azimuth, angles.elevation, model.azimuth_step, kLeastGap);
  const auto gap_at = [&](double ratio) {
    return gaps.empty() ? 1.0 : std::clamp(detail::percentile(gaps, ratio), 0.1, 5.0);
  };
  model.elevation_gap = gap_at(0.3);
  model.elevation_gap_wide = gap_at(0.9);
  return model;
}

}  // namespace dynains
