// Rows and columns of range images, and which cell a direction falls into.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>

#include "dynains/sensor/sensor_model.hpp"
#include "dynains/simd/arc_tangent.hpp"
#include "dynains/simd/lanes.hpp"
#include "dynains/simd/short_lanes.hpp"
#include "dynains/simd/wide_lanes.hpp"

namespace dynains {

/// Cells of nearly equal angle, rows by elevation and columns by azimuth, that suit a sensor.
struct RangeImageGrid {
  std::int32_t rows = 0;
  std::int32_t columns = 0;  ///< around the full circle
  float lowest = 0.0F;       ///< level of the lower edge of row 0
  float rows_per_level = 0.0F;
  float columns_per_radian = 0.0F;
  std::int32_t hole_rows = 0;  ///< empty rows between two beams that are closed

  /// What rows count instead of the elevation, from its sine: a cubic that grows with the elevation
  /// and is within 0.2 deg of it below 50 deg; beyond, rows become wider.
  template <class Number>
  static Number level(const Number& sine) {
    return sine * (kLevel[0] + kLevel[1] * (sine * sine));
  }
  static float level(float sine) {
    return sine * (kLevel[0].values[0] + kLevel[1].values[0] * (sine * sine));
  }

  /// Cells a little wider than the azimuth step and narrower than the usual gap between beams, so
  /// that few cells between returns stay empty and few returns share a cell.
  static RangeImageGrid for_sensor(const SensorModel& sensor) {
    constexpr double kRadians = M_PI / 180.0;
    constexpr double kBorder = 2.0;  // deg beyond the outer beams
    const double width = std::clamp(1.2 * sensor.azimuth_step, 0.2, 0.6);
    const double height = std::clamp(0.6 * sensor.elevation_gap, 0.2, 0.4);
    const auto level_at = [](double elevation) {
      return level(static_cast<float>(std::sin(std::clamp(elevation, -90.0, 90.0) * kRadians)));
    };
    const float highest = level_at(sensor.elevation_max + kBorder);
    RangeImageGrid grid;
    grid.lowest = level_at(sensor.elevation_min - kBorder);
    grid.rows_per_level = static_cast<float>(1.0 / (height * kRadians));
    grid.rows = static_cast<std::int32_t>((highest - grid.lowest) * grid.rows_per_level) + 1;
    grid.columns = static_cast<std::int32_t>(std::round(360.0 / width));
    grid.columns_per_radian = static_cast<float>(grid.columns / (2.0 * M_PI));
    grid.hole_rows =
        static_cast<std::int32_t>(std::round(1.2 * sensor.elevation_gap_wide / height));
    return grid;
  }

  /// Cells from the beginning of one row to the next: room for wide access past both ends.
  std::size_t stride() const {
    return (static_cast<std::size_t>(columns) + detail::kShortPackWidth - 1) /
               detail::kShortPackWidth * detail::kShortPackWidth +
           2 * detail::kPackWidth;
  }
  std::size_t cell_count() const { return static_cast<std::size_t>(rows) * stride(); }

 private:
  static constexpr detail::PackConstant kLevel[] = {0.9832868F, 0.2594117F};
};

/// Angle of (x, y) in [-pi, pi] within 1e-4 rad, for cells that are much wider; NaN for the origin.
template <class Float>
Float coarse_azimuth(const Float& x, const Float& y) {
  using detail::PackConstant;
  // atan2(|y|, |x|) = pi/4 + atan(t); minimax fit of atan(t) / t in t^2 over [-1, 1].
  static constexpr PackConstant kFit[] = {-3.898647e-02F, 1.462644e-01F, -3.211750e-01F,
                                          9.992138e-01F};
  static constexpr PackConstant kQuarter(0.5F * detail::kPi), kEighth(0.25F * detail::kPi);
  const Float ax = abs(x);
  const Float ay = abs(y);
  const Float t = (ay - ax) / (ay + ax);
  const Float u = t * t;
  Float p = kFit[0];
  for (std::size_t i = 1; i < std::size(kFit); ++i) p = p * u + kFit[i];
  const Float from_y_axis = p * t - kEighth;
  return detail::with_sign_of(y, detail::with_sign_of(x, from_y_axis) + kQuarter);
}

/// What locating needs of a grid, once for all points.
struct ImageLocator {
  explicit ImageLocator(const RangeImageGrid& grid)
      : lowest(grid.lowest),
        rows_per_level(grid.rows_per_level),
        rows(static_cast<float>(grid.rows)),
        stride(static_cast<float>(grid.stride())),
        columns_per_radian(grid.columns_per_radian),
        last_column(static_cast<float>(grid.columns) - 0.5F) {}

  /// Cells into which the directions of eight points fall; 0 where the image does not cover them.
  /// `range`: distances of the points.
  template <class Packs>
  typename Packs::Int locate(const typename Packs::Float& x, const typename Packs::Float& y,
                             const typename Packs::Float& z,
                             const typename Packs::Float& range) const {
    using Float = typename Packs::Float;
    static constexpr detail::PackConstant kZero(0.0F), kHalfTurn(detail::kPi),
        kBorder(static_cast<float>(detail::kPackWidth));
    const Float row = (RangeImageGrid::level(z / range) - lowest) * rows_per_level;
    const Float column = (coarse_azimuth(x, y) + kHalfTurn) * columns_per_radian;
    // False for the place of the sensor itself, whose row is NaN.
    const typename Packs::Mask inside = (row >= kZero) & (row < rows);
    // Row times stride is exact in floats: images have fewer than 2^24 cells.
    const Float first = to_float(truncate(keep(inside, row))) * stride;
    return keep(inside, truncate(first + kBorder) +
                            truncate(max(min(column, Float(last_column)), Float(kZero))));
  }

  detail::PackConstant lowest, rows_per_level, rows, stride, columns_per_radian, last_column;
};

}  // namespace dynains
