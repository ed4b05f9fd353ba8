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
  /// Median step between consecutive returns of one beam. Without rings, as of a sensor whose
  /// pattern does not repeat, all three are the mean distance of neighbouring returns.
  double azimuth_step = 0.0;
  double elevation_gap = 0.0;       ///< 30th percentile of the gaps between beams
  double elevation_gap_wide = 0.0;  ///< 90th percentile of these gaps
  double elevation_min = 0.0;       ///< elevation of the lowest beam
  double elevation_max = 0.0;       ///< elevation of the highest beam

  double height = 0.0;  ///< m above the ground
  /// m, level frame, where the beams begin; zero unless a scan has several sensors.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();

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
  angles.azimuth.resize(points.size() + kPackWidth);
  angles.elevation.resize(points.size() + kPackWidth);
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

/// Mean distance (deg) of neighbouring returns that are spread evenly over the field of view, whose
/// lowest and highest elevation (deg) are given.
inline double mean_spacing(const std::vector<float>& azimuths, double lowest, double highest) {
  constexpr double kSector = 4.0;  // deg; those without returns are no part of the field of view
  std::vector<std::uint8_t> seen(static_cast<std::size_t>(360.0 / kSector) + 1, 0);
  for (const float azimuth : azimuths) {
    seen[static_cast<std::uint32_t>((static_cast<double>(azimuth) + 180.0) / kSector)] = 1;
  }
  const double width = kSector * static_cast<double>(std::count(seen.begin(), seen.end(), 1));
  const double height = (std::sin(highest * kRadians) - std::sin(lowest * kRadians)) / kRadians;
  return std::sqrt(width * height / static_cast<double>(azimuths.size()));
}

/// The value above the ratio `ratio` ([0, 1]) of the other ones. Reorders `values`, which must not
/// be empty.
inline double percentile(std::vector<float>& values, double ratio) {
  const auto rank = static_cast<std::ptrdiff_t>(ratio * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return static_cast<double>(values[static_cast<std::size_t>(rank)]);
}

/// Gaps (deg) larger than `smallest` between consecutive angles `along` of the points whose angles
/// `across` lie in one band of `width` (deg, at least 0.01). All angles lie in [-180, 180]. Skips
/// bands: sorts only about a quarter of the points.
inline std::vector<float> gaps_in_bands(const std::vector<float>& across,
                                        const std::vector<float>& along, double width,
                                        double smallest) {
  const auto band_at = [&](float angle) {
    return static_cast<std::uint32_t>((static_cast<double>(angle) + 181.0) / width);
  };
  std::vector<std::uint32_t> counts(band_at(181.0F) + 1, 0);  // 180 deg may be rounded up
  std::vector<std::uint16_t> band_of(across.size());
  for (std::size_t i = 0; i < across.size(); ++i) {
    band_of[i] = static_cast<std::uint16_t>(band_at(across[i]));
    ++counts[band_of[i]];
  }
  std::vector<std::uint32_t> ends(counts.size());
  std::uint32_t sorted = 0, lower = 0;
  for (std::size_t band = 0; band < counts.size(); ++band) {
    ends[band] = sorted;
    const bool skips = 4 * sorted > lower;
    lower += counts[band];
    if (skips) counts[band] = 0;
    sorted += counts[band];
  }
  std::vector<float> angles(sorted);
  for (std::size_t i = 0; i < across.size(); ++i) {
    if (counts[band_of[i]] != 0) angles[ends[band_of[i]]++] = along[i];
  }
  std::vector<float> gaps;
  for (std::size_t band = 0; band < counts.size(); ++band) {
    const std::size_t begin = ends[band] - counts[band];
    std::sort(angles.data() + begin, angles.data() + ends[band]);
    for (std::size_t i = begin + 1; i < ends[band]; ++i) {
      const float gap = angles[i] - angles[i - 1];
      if (static_cast<double>(gap) > smallest) gaps.push_back(gap);
    }
  }
  return gaps;
}

}  // namespace detail

/// Points of a scan that estimate_sensor_model() asks for.
inline constexpr std::size_t kMinOfSensor = 500;

/// Estimates the angular sampling from one scan (m, sensor frame, finite coordinates). Sets the
/// height of SensorModel::typical(); estimate_mounting() estimates the height. The result is not
/// known() if the scan has fewer than kMinOfSensor points, or no two points on one beam.
/// Allocates memory, so call it for one scan of a sensor, not for each.
inline SensorModel estimate_sensor_model(PointsView points) {
  if (points.size() < kMinOfSensor) return {};
  const detail::BeamAngles angles = detail::beam_angles(points);
  SensorModel model;
  model.height = SensorModel::typical().height;
  std::vector<float> elevations = angles.elevation;
  model.elevation_min = detail::percentile(elevations, 0.0005);
  model.elevation_max = detail::percentile(elevations, 0.9995);
  // The elevations of one beam differ by up to 0.1 deg, those of two beams by 0.08 deg or more.
  std::vector<float> steps = detail::gaps_in_bands(angles.elevation, angles.azimuth, 0.1, 0.01);
  if (steps.empty()) return {};
  model.azimuth_step = std::clamp(detail::percentile(steps, 0.5), 0.05, 2.0);
  // Returns of one ring are closer together than those that are spread evenly.
  const double spacing =
      detail::mean_spacing(angles.azimuth, model.elevation_min, model.elevation_max);
  if (model.azimuth_step > spacing) {
    model.azimuth_step = model.elevation_gap = model.elevation_gap_wide = spacing;
    return model;
  }
  std::vector<float> gaps =
      detail::gaps_in_bands(angles.azimuth, angles.elevation, model.azimuth_step, 0.08);
  const auto gap_at = [&](double ratio) {
    return gaps.empty() ? 1.0 : std::clamp(detail::percentile(gaps, ratio), 0.1, 5.0);
  };
  model.elevation_gap = gap_at(0.3);
  model.elevation_gap_wide = gap_at(0.9);
  return model;
}

}  // namespace dynains
