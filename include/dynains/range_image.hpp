// Range image of a scan, kept for asking later how far a beam in some direction got.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <vector>

#include "dynains/detail/arc_tangent.hpp"
#include "dynains/detail/lanes.hpp"
#include "dynains/detail/short_lanes.hpp"
#include "dynains/detail/wide_lanes.hpp"
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
    return (static_cast<std::size_t>(columns) + detail::kLanes - 1) / detail::kLanes *
               detail::kLanes +
           2 * detail::kLanes;
  }
  std::size_t cell_count() const { return static_cast<std::size_t>(rows) * stride(); }

 private:
  static constexpr detail::Constant8 kLevel[] = {0.9832868F, 0.2594117F};
};

/// Directions of eight points: where they fall in an image and how far they are.
template <class Lanes>
struct ImageLocation {
  typename Lanes::Int cell;     ///< index into the image; 0 where `inside` is not set
  typename Lanes::Mask inside;  ///< whether the image covers the direction
  typename Lanes::Float range;  ///< m
};

/// Angle of (x, y) in [-pi, pi] within 1e-4 rad, for cells that are much wider; NaN for the origin.
template <class Float>
Float coarse_azimuth(const Float& x, const Float& y) {
  using detail::Constant8;
  // atan2(|y|, |x|) = pi/4 + atan(t); minimax fit of atan(t) / t in t^2 over [-1, 1].
  static constexpr Constant8 kFit[] = {-3.898647e-02F, 1.462644e-01F, -3.211750e-01F,
                                       9.992138e-01F};
  static constexpr Constant8 kQuarter(0.5F * detail::kPi), kEighth(0.25F * detail::kPi);
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

  template <class Lanes>
  ImageLocation<Lanes> locate(const typename Lanes::Float& x, const typename Lanes::Float& y,
                              const typename Lanes::Float& z) const {
    using Float = typename Lanes::Float;
    static constexpr detail::Constant8 kZero(0.0F), kHalfTurn(detail::kPi),
        kBorder(static_cast<float>(detail::kLanes));
    const Float range = sqrt((x * x + y * y) + z * z);
    const Float row = (RangeImageGrid::level(z / range) - lowest) * rows_per_level;
    const Float column = (coarse_azimuth(x, y) + kHalfTurn) * columns_per_radian;
    // False for the place of the sensor itself, whose row is NaN.
    const typename Lanes::Mask inside = (row >= kZero) & (row < rows);
    // Row times stride is exact in floats: images have fewer than 2^24 cells.
    const Float first = to_float(truncate(keep(inside, row))) * stride;
    const typename Lanes::Int cell =
        truncate(first + kBorder) + truncate(max(min(column, Float(last_column)), Float(kZero)));
    return {keep(inside, cell), inside, range};
  }

  detail::Constant8 lowest, rows_per_level, rows, stride, columns_per_radian, last_column;
};

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
  const Cell* data() const { return cells_.get(); }

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
    const ImageLocator locator(grid);
    static constexpr detail::Constant8 kMost(kFarthest), kScale(kCentimetres);
    detail::for_lanes(points.size(), [&](auto place) {
      using Lanes = decltype(place);
      using Float = typename Lanes::Float;
      const ImageLocation<Lanes> at = locator.locate<Lanes>(
          place.load(points.x.data()), place.load(points.y.data()), place.load(points.z.data()));
      std::int32_t cell[detail::kLanes];
      std::int32_t range[detail::kLanes];
      at.cell.store(cell);
      truncate(min(at.range, Float(kMost)) * kScale).store(range);
      // Directions outside fall into cell 0, which lies in the border and is never read.
      for (std::size_t lane = 0; lane < place.size(); ++lane) {
        std::int16_t& value = nearest[cell[lane]];
        value = std::min(value, static_cast<std::int16_t>(range[lane]));
      }
    });
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
    make_cells(grid.cell_count());
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

  // Without values: an image is the largest buffer of all, and each of its cells is written before
  // it is read but the first, which stands for all directions outside.
  void make_cells(std::size_t count) {
    if (count == cell_count_) return;
    cells_ = std::unique_ptr<Cell[]>(new Cell[count]);
    cells_[0] = {kNothing, kUnknown};
    cell_count_ = count;
  }

  std::unique_ptr<Cell[]> cells_;
  std::size_t cell_count_ = 0;
};

}  // namespace dynains
