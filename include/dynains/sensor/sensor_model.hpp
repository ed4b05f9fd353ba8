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

/// Values of an angle in bands of equal width.
class AngleBands {
 public:
  /// `angles`: deg, [-180, 360]. `width`: of a band, deg, at least 0.01.
  void assign(const std::vector<float>& angles, double width) {
    const auto band_of = [&](float angle) {
      return static_cast<std::uint16_t>(
          static_cast<std::int32_t>((static_cast<double>(angle) + 181.0) / width));
    };
    band_.resize(angles.size());
    for (std::size_t i = 0; i < angles.size(); ++i) band_[i] = band_of(angles[i]);
    begin_.assign(band_of(361.0F) + std::size_t{2}, 0);
    // Consecutive angles mostly share a band, whose count waits for the last one: two counts at
    // once.
    const std::size_t half = band_.size() / 2;
    for (std::size_t i = 0; i < half; ++i) {
      ++begin_[band_[i] + std::size_t{1}];
      ++begin_[band_[half + i] + std::size_t{1}];
    }
    if (band_.size() % 2 != 0) ++begin_[band_.back() + std::size_t{1}];
    accumulate(begin_);
  }

  /// The angle above the ratio `ratio` ([0, 1]) of the other ones. `angles`: as assigned, not
  /// empty.
  double percentile(const std::vector<float>& angles, double ratio) const {
    const auto rank = static_cast<std::uint32_t>(ratio * static_cast<double>(angles.size() - 1));
    const auto above = std::upper_bound(begin_.begin(), begin_.end(), rank) - 1;
    std::vector<float> inside;
    for (std::size_t i = 0; i < angles.size(); ++i) {
      if (band_[i] == above - begin_.begin()) inside.push_back(angles[i]);
    }
    const auto at = inside.begin() + static_cast<std::ptrdiff_t>(rank - *above);
    std::nth_element(inside.begin(), at, inside.end());
    return static_cast<double>(*at);
  }

  /// Gaps (deg) larger than `smallest` (deg) between consecutive values of another angle of the
  /// same points, `along` (deg, [-180, 180]), within each band. Valid until the next call. Skips
  /// bands: sorts only about a quarter of the points.
  const std::vector<float>& gaps(const std::vector<float>& along, double smallest) {
    choose_bands();
    sort_roughly(along);
    for (const Point& point : rough_) sorted_[end_[point.band]++] = point.along;
    std::size_t begin = 0, count = 0;
    for (std::size_t band = 0; band < end_.size(); ++band) {
      if (is_sorted_[band] == 0) continue;
      std::sort(sorted_.data() + begin, sorted_.data() + end_[band]);
      for (std::size_t k = begin + 1; k < end_[band]; ++k) {
        const float gap = sorted_[k] - sorted_[k - 1];
        sorted_[count] = gap;
        count += static_cast<double>(gap) > smallest ? 1U : 0U;
      }
      begin = end_[band];
    }
    sorted_.resize(count);
    return sorted_;
  }

 private:
  struct Point {
    std::uint32_t band;
    float along;  // deg
  };

  static void accumulate(std::vector<std::uint32_t>& values) {
    for (std::size_t i = 1; i < values.size(); ++i) values[i] += values[i - 1];
  }

  void choose_bands() {
    constexpr std::uint32_t kPointsPerSorted = 4;
    end_.resize(begin_.size() - 1);
    is_sorted_.assign(end_.size(), 0);
    std::uint32_t sorted = 0;
    for (std::size_t band = 0; band < end_.size(); ++band) {
      end_[band] = sorted;
      if (sorted * kPointsPerSorted > begin_[band]) continue;
      is_sorted_[band] = 1;
      sorted += begin_[band + 1] - begin_[band];
    }
    sorted_.resize(sorted);
  }

  // The points of the chosen bands, sorted by steps of the angle `along`: std::sort() is faster if
  // its input is nearly sorted, for it can be predicted.
  void sort_roughly(const std::vector<float>& along) {
    chosen_.resize(sorted_.size() + 1);
    std::size_t count = 0;
    for (std::size_t i = 0; i < along.size(); ++i) {
      chosen_[count] = {band_[i], along[i]};
      count += is_sorted_[band_[i]];
    }
    chosen_.resize(count);
    constexpr std::size_t kSteps = 2048;
    const auto step_of = [](const Point& point) {
      return static_cast<std::size_t>((point.along + 181.0F) * (kSteps / 362.0F));
    };
    next_.assign(kSteps + 1, 0);
    for (const Point& point : chosen_) ++next_[step_of(point) + 1];
    accumulate(next_);
    rough_.resize(count);
    for (const Point& point : chosen_) rough_[next_[step_of(point)]++] = point;
  }

  std::vector<std::uint16_t> band_;      // by point
  std::vector<std::uint32_t> begin_;     // by band: number of points in lower bands
  std::vector<std::uint8_t> is_sorted_;  // by band: 1 or 0
  std::vector<std::uint32_t> end_;       // by band, in sorted_
  std::vector<std::uint32_t> next_;      // by step, in rough_
  std::vector<Point> chosen_, rough_;
  std::vector<float> sorted_;
};

}  // namespace detail

/// Estimates the angular sampling from one scan (m, sensor frame, finite coordinates). Sets the
/// height of SensorModel::typical(); estimate_mounting() estimates the height. The result is not
/// known() if the scan has fewer than 500 points, or no two points on one beam. Allocates memory,
/// so call it for one scan of a sensor, not for each.
inline SensorModel estimate_sensor_model(PointsView points) {
  constexpr std::size_t kFewest = 500;
  if (points.size() < kFewest) return {};
  constexpr double kBeamBand = 0.1;    // deg, range of the elevations of one beam
  constexpr double kLeastStep = 0.01;  // deg
  constexpr double kLeastGap = 0.08;   // deg, between beams
  constexpr double kGapBand = 0.01;    // deg
  const detail::BeamAngles angles = detail::beam_angles(points);
  SensorModel model;
  model.height = SensorModel::typical().height;
  detail::AngleBands bands, gap_bands;
  bands.assign(angles.elevation, kBeamBand);
  model.elevation_min = bands.percentile(angles.elevation, 0.0005);
  model.elevation_max = bands.percentile(angles.elevation, 0.9995);
  const std::vector<float>& steps = bands.gaps(angles.azimuth, kLeastStep);
  if (steps.empty()) return {};
  gap_bands.assign(steps, kGapBand);
  model.azimuth_step = std::clamp(gap_bands.percentile(steps, 0.5), 0.05, 2.0);

  bands.assign(angles.azimuth, model.azimuth_step);
  const std::vector<float>& gaps = bands.gaps(angles.elevation, kLeastGap);
  gap_bands.assign(gaps, kGapBand);
  const auto gap_at = [&](double ratio) {
    return gaps.empty() ? 1.0 : std::clamp(gap_bands.percentile(gaps, ratio), 0.1, 5.0);
  };
  model.elevation_gap = gap_at(0.3);
  model.elevation_gap_wide = gap_at(0.9);
  return model;
}

}  // namespace dynains
