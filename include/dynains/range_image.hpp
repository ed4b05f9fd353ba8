// Range image of a scan, kept for asking later how far a beam in some direction got.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/detail/arc_tangent.hpp"
#include "dynains/detail/lanes.hpp"
#include "dynains/detail/short_lanes.hpp"
#include "dynains/points.hpp"
#include "dynains/sensor_model.hpp"

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
  static Number level(Number sine) {
    return sine * (Number(0.9832868F) + Number(0.2594117F) * (sine * sine));
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
    return (static_cast<std::size_t>(columns) + detail::kLanes - 1) / detail::kLanes *
               detail::kLanes +
           2 * detail::kLanes;
  }
  std::size_t cell_count() const { return static_cast<std::size_t>(rows) * stride(); }
};

/// Directions of eight points: where they fall in an image and how far they are.
struct ImageLocation {
  detail::Int8 cell;     ///< index into the image; 0 where `inside` is not set
  detail::Mask8 inside;  ///< whether the image covers the direction
  detail::Float8 range;  ///< m
};

/// Angle of (x, y) in [-pi, pi] within 1e-4 rad, for cells that are much wider; NaN for the origin.
inline detail::Float8 coarse_azimuth(detail::Float8 x, detail::Float8 y) {
  using detail::Float8;
  const Float8 ax = abs(x);
  const Float8 ay = abs(y);
  // atan2(ay, ax) = pi/4 + atan(t); minimax fit of atan(t) / t in t^2 over [-1, 1].
  const Float8 t = (ay - ax) / (ay + ax);
  const Float8 u = t * t;
  Float8 p(-3.898647e-02F);
  p = p * u + Float8(1.462644e-01F);
  p = p * u + Float8(-3.211750e-01F);
  p = p * u + Float8(9.992138e-01F);
  const Float8 from_y_axis = p * t - Float8(0.25F * detail::kPi);
  return with_sign_of(y, with_sign_of(x, from_y_axis) + Float8(0.5F * detail::kPi));
}

inline ImageLocation locate(const RangeImageGrid& grid, detail::Float8 x, detail::Float8 y,
                            detail::Float8 z) {
  using detail::Float8;
  using detail::Int8;
  const Float8 range = sqrt((x * x + y * y) + z * z);
  const Float8 row =
      (RangeImageGrid::level(z / range) - Float8(grid.lowest)) * Float8(grid.rows_per_level);
  const Float8 column =
      (coarse_azimuth(x, y) + Float8(detail::kPi)) * Float8(grid.columns_per_radian);
  // False for the place of the sensor itself, whose row is NaN.
  const detail::Mask8 inside =
      (row >= Float8(0.0F)) & (row < Float8(static_cast<float>(grid.rows)));
  // Row times stride is exact in floats: images have fewer than 2^24 cells.
  const Float8 first =
      to_float(detail::truncate(keep(inside, row))) * Float8(static_cast<float>(grid.stride()));
  const Float8 last_column(static_cast<float>(grid.columns) - 0.5F);
  const Int8 cell = detail::truncate(first + Float8(static_cast<float>(detail::kLanes))) +
                    detail::truncate(max(min(column, last_column), Float8(0.0F)));
  return {keep(inside, cell), inside, range};
}

/// Nearest return per cell, and the nearest return of the 3x3 cells around it.
///
/// The neighbourhood is the margin against grazing incidence: a beam just below a sample protects
/// the ground, one beside it protects edges.
class RangeImage {
 public:
  /// A cell in four bytes, both values in centimetres.
  struct Cell {
    std::int16_t nearest;  ///< kNothing if no beam returned here
    std::int16_t around;   ///< kUnknown if fewer than two of the 3x3 cells have a return
  };
  static constexpr std::int16_t kNothing = 32767;
  static constexpr std::int16_t kUnknown = -1;

  /// Buffers that building needs, shared by all images of one owner.
  struct Scratch {
    std::vector<std::int16_t> nearest;
    std::vector<std::int16_t> below, gap;
    std::vector<std::int16_t> least, count;
    std::vector<std::int16_t> border;
    std::vector<std::int16_t> reaching, widened;
    std::vector<std::int16_t> row_least, widened_least;
  };

  const Cell& operator[](std::size_t cell) const { return cells_[cell]; }
  const Cell* data() const { return cells_.data(); }

  /// Replaces the image by that of one scan (m, sensor frame). A return of an object protects what
  /// lies within `reach` (m) beside it, at least its 3x3 cells: near the sensor these are a few
  /// centimetres wide, less than what poses are good for.
  void build(const RangeImageGrid& grid, PointsView ground, PointsView objects, float reach,
             Scratch& scratch) {
    scratch.nearest.assign(grid.cell_count(), kNothing);
    collect(grid, objects, scratch.nearest.data());
    scratch.reaching = scratch.nearest;
    collect(grid, ground, scratch.nearest.data());
    close_holes(grid, scratch);
    store_with_least_around(grid, scratch);
    find_row_least(grid, scratch);
    constexpr int kWidest = 4;  // cells
    for (int cells = 1; cells <= kWidest; ++cells) {
      const float limit = reach * grid.columns_per_radian / (static_cast<float>(cells) - 0.5F);
      widen(grid, static_cast<std::int16_t>(std::min(limit, kFarthest) * kCentimetres), scratch);
    }
  }

 private:
  static constexpr float kCentimetres = 100.0F;
  static constexpr float kFarthest = 320.0F;  // m

  static void collect(const RangeImageGrid& grid, PointsView points, std::int16_t* nearest) {
    using detail::Float8;
    const auto add = [&](Float8 x, Float8 y, Float8 z, std::size_t lanes) {
      const ImageLocation at = locate(grid, x, y, z);
      std::int32_t cell[detail::kLanes];
      std::int32_t range[detail::kLanes];
      at.cell.store(cell);
      detail::truncate(min(at.range, Float8(kFarthest)) * Float8(kCentimetres)).store(range);
      // Directions outside fall into cell 0, which lies in the border and is never read.
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        std::int16_t& value = nearest[cell[lane]];
        value = std::min(value, static_cast<std::int16_t>(range[lane]));
      }
    };
    std::size_t i = 0;
    for (; i + detail::kLanes <= points.size(); i += detail::kLanes) {
      add(Float8::load(&points.x[i]), Float8::load(&points.y[i]), Float8::load(&points.z[i]),
          detail::kLanes);
    }
    if (i < points.size()) {
      float tail[3][detail::kLanes] = {};
      const std::size_t lanes = points.size() - i;
      std::copy_n(points.x.begin() + i, lanes, tail[0]);
      std::copy_n(points.y.begin() + i, lanes, tail[1]);
      std::copy_n(points.z.begin() + i, lanes, tail[2]);
      add(Float8::load(tail[0]), Float8::load(tail[1]), Float8::load(tail[2]), lanes);
    }
  }

  // Between two beams an image has rows that no beam can fill. Up to `hole_rows` of them take the
  // nearer of the returns below and above.
  static void close_holes(const RangeImageGrid& grid, Scratch& scratch) {
    using namespace detail;
    const std::size_t stride = grid.stride();
    const Short8 zero = all_shorts(0);
    const Short8 one = all_shorts(1);
    const Short8 nothing = all_shorts(kNothing);
    const Short8 widest = all_shorts(static_cast<std::int16_t>(grid.hole_rows));
    // By column: the last return below, and how many rows are empty since; too many if there is
    // none.
    scratch.below.assign(stride, kNothing);
    scratch.gap.assign(stride, static_cast<std::int16_t>(grid.hole_rows + 1));
    for (std::size_t row = 0; row < static_cast<std::size_t>(grid.rows); ++row) {
      for (std::size_t column = kLanes; column + kLanes < stride; column += kLanes) {
        std::int16_t* const at = &scratch.nearest[row * stride + column];
        const Short8 here = load_shorts(at);
        const Short8 below = load_shorts(&scratch.below[column]);
        const Short8 gap = load_shorts(&scratch.gap[column]);
        const Short8 returned = here < nothing;
        const Short8 closes = returned & (gap > zero) & (gap <= widest);
        if (any_short(closes)) {
          const Short8 fill = min_shorts(here, below);
          std::int16_t* to = at;
          for (Short8 left = closes & gap; any_short(left > zero); left = left - one) {
            to -= stride;
            store_shorts(to, select_shorts(left > zero, fill, load_shorts(to)));
          }
        }
        store_shorts(&scratch.below[column], select_shorts(returned, here, below));
        store_shorts(&scratch.gap[column], ~returned & min_shorts(gap + one, widest + one));
      }
    }
  }

  // The nearest return of the 3x3 cells about each cell, beside its own.
  void store_with_least_around(const RangeImageGrid& grid, Scratch& scratch) {
    using namespace detail;
    const std::size_t stride = grid.stride();
    const auto rows = static_cast<std::size_t>(grid.rows);
    const auto columns = static_cast<std::size_t>(grid.columns);
    cells_.resize(grid.cell_count());
    scratch.least.resize(stride);
    scratch.count.resize(stride);
    scratch.border.assign(stride, kNothing);
    for (std::size_t row = 0; row < rows; ++row) wrap(&scratch.nearest[row * stride], columns);
    const Short8 nothing = all_shorts(kNothing);
    const Short8 unknown = all_shorts(kUnknown);
    const Short8 one = all_shorts(1);
    for (std::size_t row = 0; row < rows; ++row) {
      const std::int16_t* const middle = &scratch.nearest[row * stride];
      const std::int16_t* const low = row > 0 ? middle - stride : scratch.border.data();
      const std::int16_t* const high = row + 1 < rows ? middle + stride : scratch.border.data();
      for (std::size_t column = 0; column < stride; column += kLanes) {
        const Short8 a = load_shorts(low + column);
        const Short8 b = load_shorts(middle + column);
        const Short8 c = load_shorts(high + column);
        store_shorts(&scratch.least[column], min_shorts(min_shorts(a, b), c));
        store_shorts(&scratch.count[column],
                     Short8(-(a < nothing) - (b < nothing) - (c < nothing)));
      }
      for (std::size_t column = kLanes; column + kLanes < stride; column += kLanes) {
        const std::int16_t* const least = &scratch.least[column];
        const std::int16_t* const count = &scratch.count[column];
        const Short8 around = min_shorts(min_shorts(load_shorts(least - 1), load_shorts(least)),
                                         load_shorts(least + 1));
        const Short8 returns = load_shorts(count - 1) + load_shorts(count) + load_shorts(count + 1);
        store_interleaved(&cells_[row * stride + column].nearest, load_shorts(middle + column),
                          select_shorts(returns > one, around, unknown));
      }
    }
  }

  // Nearest of each row of `reaching`.
  static void find_row_least(const RangeImageGrid& grid, Scratch& scratch) {
    using namespace detail;
    const std::size_t stride = grid.stride();
    scratch.row_least.resize(static_cast<std::size_t>(grid.rows));
    for (std::size_t row = 0; row < scratch.row_least.size(); ++row) {
      Short8 least = all_shorts(kNothing);
      for (std::size_t column = kLanes; column + kLanes < stride; column += kLanes) {
        least = min_shorts(least, load_shorts(&scratch.reaching[row * stride + column]));
      }
      scratch.row_least[row] = least_short(least);
    }
  }

  // Lets returns of objects that are nearer than `limit` (cm) reach one cell farther in every
  // direction: `reaching` holds nothing else, and the cells take the result in. Rows without such
  // returns are not looked at.
  void widen(const RangeImageGrid& grid, std::int16_t limit, Scratch& scratch) {
    using namespace detail;
    const std::size_t stride = grid.stride();
    const auto rows = static_cast<std::size_t>(grid.rows);
    const auto columns = static_cast<std::size_t>(grid.columns);
    scratch.widened.resize(grid.cell_count());
    scratch.widened_least.assign(rows, kNothing);
    const Short8 nothing = all_shorts(kNothing);
    const Short8 near = all_shorts(limit);
    const auto line = [&](std::size_t row) {
      return row < rows && scratch.row_least[row] < limit ? &scratch.reaching[row * stride]
                                                          : nullptr;
    };
    for (std::size_t row = 0; row < rows; ++row) {
      if (line(row) != nullptr) wrap(line(row), columns);
    }
    for (std::size_t row = 0; row < rows; ++row) {
      const std::int16_t* low = row > 0 ? line(row - 1) : nullptr;
      const std::int16_t* middle = line(row);
      const std::int16_t* high = line(row + 1);
      if (low == nullptr && middle == nullptr && high == nullptr) continue;
      if (low == nullptr) low = scratch.border.data();
      if (middle == nullptr) middle = scratch.border.data();
      if (high == nullptr) high = scratch.border.data();
      for (std::size_t column = 0; column < stride; column += kLanes) {
        const Short8 least =
            min_shorts(min_shorts(load_shorts(low + column), load_shorts(middle + column)),
                       load_shorts(high + column));
        store_shorts(&scratch.least[column], select_shorts(least < near, least, nothing));
      }
      Short8 row_least = nothing;
      for (std::size_t column = kLanes; column + kLanes < stride; column += kLanes) {
        const std::int16_t* const least = &scratch.least[column];
        const Short8 reach = min_shorts(min_shorts(load_shorts(least - 1), load_shorts(least)),
                                        load_shorts(least + 1));
        store_shorts(&scratch.widened[row * stride + column], reach);
        row_least = min_shorts(row_least, reach);
        if (any_short(reach < nothing)) protect(&cells_[row * stride + column], reach);
      }
      scratch.widened_least[row] = least_short(row_least);
    }
    scratch.reaching.swap(scratch.widened);
    scratch.row_least.swap(scratch.widened_least);
  }

  // Lets `around` of eight cells be at most `reach`; kNothing changes nothing.
  static void protect(Cell* cells, detail::Short8 reach) {
    using namespace detail;
    const Short8 nothing = all_shorts(kNothing);
    std::int16_t limits[2 * kLanes];
    store_interleaved(limits, nothing, reach);
    for (std::size_t half = 0; half < 2; ++half) {
      std::int16_t* const at = &cells[half * kLanes / 2].nearest;
      const Short8 here = load_shorts(at);
      const Short8 limit = load_shorts(limits + half * kLanes);
      const Short8 known = select_shorts((here < all_shorts(0)) & (limit < nothing), nothing, here);
      store_shorts(at, min_shorts(known, limit));
    }
  }

  // Copies the ends of a row to its other side, so that neighbours across the seam are at hand.
  static void wrap(std::int16_t* row, std::size_t columns) {
    row[detail::kLanes - 1] = row[detail::kLanes + columns - 1];
    row[detail::kLanes + columns] = row[detail::kLanes];
  }

  std::vector<Cell> cells_;
};

}  // namespace dynains
