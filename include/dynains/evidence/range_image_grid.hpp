// Grid of range images: rows, columns, and the cell of a direction.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>

#include "dynains/pose.hpp"
#include "dynains/sensor/sensor_model.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains {

/// Grid of nearly equal angles for a sensor: rows by elevation, columns by azimuth.
struct RangeImageGrid {
  std::int32_t rows = 0;
  std::int32_t columns = 0;  ///< around the full circle
  float lowest = 0.0F;       ///< level() of the lower edge of row 0
  float rows_per_level = 0.0F;
  float columns_per_radian = 0.0F;
  std::int32_t hole_rows = 0;  ///< largest gap between two beams that is filled, in rows

  /// Approximate elevation (rad) by its sine: a monotonic cubic, with an error up to 0.2 deg at
  /// elevations within 50 deg. Rows at steeper elevations are wider.
  template <class Number>
  static Number level(const Number& sine) {
    return sine * (kLevel[0] + kLevel[1] * (sine * sine));
  }
  static float level(float sine) {
    return sine * (kLevel[0].values[0] + kLevel[1].values[0] * (sine * sine));
  }

  /// Grid for a sensor. The cells are slightly wider than its azimuth step and lower than the gap
  /// between its beams: few cells between returns are empty, and few returns share a cell.
  static RangeImageGrid for_sensor(const SensorModel& sensor) {
    constexpr double kBorder = 2.0;  // deg beyond the outer beams
    const double width = std::clamp(1.2 * sensor.azimuth_step, 0.2, 0.8);
    const double height = std::clamp(0.6 * sensor.elevation_gap, 0.2, 0.4);
    const auto level_at = [](double elevation) {
      return level(
          static_cast<float>(std::sin(std::clamp(elevation, -90.0, 90.0) * detail::kRadians)));
    };
    const float highest = level_at(sensor.elevation_max + kBorder);
    RangeImageGrid grid;
    grid.lowest = level_at(sensor.elevation_min - kBorder);
    grid.rows_per_level = static_cast<float>(1.0 / (height * detail::kRadians));
    grid.rows = static_cast<std::int32_t>((highest - grid.lowest) * grid.rows_per_level) + 1;
    grid.columns = static_cast<std::int32_t>(std::round(360.0 / width));
    grid.columns_per_radian = static_cast<float>(grid.columns / (2.0 * M_PI));
    grid.hole_rows =
        static_cast<std::int32_t>(std::round(1.2 * sensor.elevation_gap_wide / height));
    return grid;
  }

  /// Number of cells from one row to the next, with padding for packs at both ends.
  std::size_t stride() const {
    return (static_cast<std::size_t>(columns) + detail::kShortPackWidth - 1) /
               detail::kShortPackWidth * detail::kShortPackWidth +
           2 * detail::kPackWidth;
  }
  /// Index of a cell in the image. Cells between the rows are padding.
  std::size_t cell(std::int32_t row, std::int32_t column) const {
    return static_cast<std::size_t>(row) * stride() + detail::kPackWidth +
           static_cast<std::size_t>(column);
  }
  std::size_t cell_count() const { return static_cast<std::size_t>(rows) * stride(); }

 private:
  static constexpr detail::PackConstant kLevel[] = {0.9832868F, 0.2594117F};
};

/// Azimuth (rad) of (x, y) in [-pi, pi], with an error below 1e-4 rad; NaN for the origin.
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

/// Computes the cells of points in a grid.
struct ImageLocator {
  explicit ImageLocator(const RangeImageGrid& grid)
      : lowest(grid.lowest),
        rows_per_level(grid.rows_per_level),
        rows(static_cast<float>(grid.rows)),
        stride(static_cast<float>(grid.stride())),
        columns_per_radian(grid.columns_per_radian),
        last_column(static_cast<float>(grid.columns) - 0.5F) {}

  /// Directions of points in the grid.
  template <class Packs>
  struct Located {
    typename Packs::Int cell;      ///< index of the cell; 0 outside the image
    typename Packs::Float row;     ///< place in the cell, from 0 to 1
    typename Packs::Float column;  ///< place in the cell, from 0 to 1
  };
  /// `range`: distances of the points from the sensor, in the unit of `x`, `y` and `z`.
  template <class Packs>
  Located<Packs> locate(const typename Packs::Float& x, const typename Packs::Float& y,
                        const typename Packs::Float& z, const typename Packs::Float& range) const {
    using Float = typename Packs::Float;
    static constexpr detail::PackConstant kZero(0.0F), kHalfTurn(detail::kPi),
        kBorder(static_cast<float>(detail::kPackWidth));
    const Float row = (RangeImageGrid::level(z / range) - lowest) * rows_per_level;
    const Float column = (coarse_azimuth(x, y) + kHalfTurn) * columns_per_radian;
    // False for the origin, since its row is NaN.
    const typename Packs::Mask inside = (row >= kZero) & (row < rows);
    // Exact in single precision, since images have fewer than 2^24 cells.
    const Float row_index = to_float(truncate(keep(inside, row)));
    const typename Packs::Int column_index =
        truncate(max(min(column, Float(last_column)), Float(kZero)));
    return {inside & (truncate(row_index * stride + kBorder) + column_index), row - row_index,
            column - to_float(column_index)};
  }

  detail::PackConstant lowest, rows_per_level, rows, stride, columns_per_radian, last_column;
};

}  // namespace dynains
