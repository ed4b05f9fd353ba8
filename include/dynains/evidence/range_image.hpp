// Range image of a scan: ranges of its returns by direction (Pomerleau et al., ICRA 2014; nearest
// return of a neighbourhood as in Kim and Kim, Remove, then Revert, IROS 2020).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <optional>
#include <vector>

#include "dynains/points.hpp"
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

  /// Grid for some scans of a sensor. The cells are slightly wider than its azimuth step and lower
  /// than the gap between its beams: few cells between returns are empty, and few returns share a
  /// cell. Cells of several scans are smaller, so that their returns protect less around them; the
  /// exponent was chosen on random worlds.
  static RangeImageGrid for_sensor(const SensorModel& sensor, int scans = 1) {
    constexpr double kBorder = 2.0;  // deg beyond the outer beams
    const double density = std::cbrt(static_cast<double>(scans));
    const double width = std::clamp(1.2 * sensor.azimuth_step, 0.2, 0.8) / density;
    const double height = std::clamp(0.6 * sensor.elevation_gap, 0.2, 0.4) / density;
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

/// Range image with the nearest return of each cell and its direction, and the nearest return of
/// its 3x3 cells.
///
/// A return protects the samples in its 3x3 cells: samples at its range or behind it are not free.
/// This margin keeps ground at grazing incidence and edges of objects. Returns of moving points
/// have no such margin: they only occlude the points behind them in their own cells.
class RangeImage {
 public:
  /// Ranges in cm: even for static points, odd for moving points.
  struct Cell {
    /// Range of the nearest return of a moving point in the 3x3 cells; without one, range of the
    /// nearest return in this cell; without a return, kNothing.
    std::int16_t nearest;
    /// Range of the nearest return in the 3x3 cells, except returns of moving points in the eight
    /// outer cells. kUnknown if fewer than two cells have such a return, or if no beam crosses the
    /// cell: neither it nor both cells beside it have a return.
    std::int16_t around;
  };
  /// Direction of the nearest return of a cell: its place along the columns (upper byte) and along
  /// the rows (lower byte) of the cell, in 1/kPlaces of it. Without a return, kCentre.
  using Beam = std::uint16_t;
  static constexpr std::int32_t kPlaces = 256;
  static constexpr Beam kCentre = 128 << 8 | 128;
  static constexpr float kCentimetres = 100.0F;  ///< unit of ranges, per metre
  static constexpr std::int16_t kMoving = 1;     ///< bit that is set in ranges of moving points
  static constexpr std::int16_t kNothing = 32766;
  static constexpr std::int16_t kUnknown = -2;

  /// Points of one scan, m.
  struct Scan {
    PointsView ground, objects;
    Span<const std::uint8_t> moving;  ///< by object point, 1 if it moves; empty if none does
    std::optional<detail::PackTransform> to_image;  ///< from the frame of the points, if it differs
  };

  /// Buffers of build(), which several images can share.
  struct Scratch {
    std::vector<std::int32_t> returns;         // by cell: nearest return, see collect()
    std::vector<std::int16_t> nearest;         // by cell: its range
    std::vector<std::int16_t> objects, wider;  // by cell: nearest static object, see widen()
    std::vector<std::int16_t> below, gap;      // by column, see close_holes()
    std::vector<std::int16_t> least, min_moving, count;  // by column, see merge_three_rows()
    std::vector<std::int16_t> border;                    // row of kNothing
  };

  const Cell& operator[](std::size_t cell) const { return cells_[cell]; }
  const Cell* data() const { return cells_.get(); }
  /// By cell.
  const Beam* beams() const { return beams_.get(); }
  /// A cell to write, for images that are read from files. Call allocate() before.
  Cell& cell(std::size_t index) { return cells_[index]; }
  Beam& beam(std::size_t index) { return beams_[index]; }
  /// The grid of the image; empty before the first allocate().
  const RangeImageGrid& grid() const { return grid_; }

  /// Allocates the cells without initialising them, since build() writes each. The exception is
  /// cell 0, the cell of all directions outside the image.
  void allocate(const RangeImageGrid& grid) {
    if (grid.cell_count() > capacity_) {
      capacity_ = grid.cell_count();
      cells_ = std::unique_ptr<Cell[]>(new Cell[grid.cell_count()]);
      cells_[0] = {kNothing, kUnknown};
      beams_ = std::unique_ptr<Beam[]>(new Beam[grid.cell_count()]);
      beams_[0] = kCentre;
    }
    grid_ = grid;
  }

  /// Replaces the image by the image of some scans. `reach` (m): a return of an object protects the
  /// cells within this lateral distance, and at least its 3x3 cells. Near the sensor, the 3x3 cells
  /// alone are narrower than the error of the poses.
  void build(const RangeImageGrid& grid, Span<const Scan> scans, float reach, Scratch& scratch) {
    allocate(grid);
    scratch.returns.assign(grid.cell_count(), kNoReturn);
    scratch.border.assign(grid.stride(), kNothing);
    for (const Scan& scan : scans) collect(grid, scan, scan.objects, scan.moving, scratch);
    keep_objects(scratch);
    for (const Scan& scan : scans) collect(grid, scan, scan.ground, {}, scratch);
    split(scratch);
    close_holes(grid, scratch);
    store_with_least_around(grid, scratch);
    widen(grid, reach, scratch);
  }

 private:
  static constexpr float kMaxRange = 320.0F;  // m

  static constexpr std::int32_t kNoReturn = kNothing << 16 | kCentre;

  // Writes the nearest return of each cell: its range, then the places of its column and its row,
  // 8 bits each. Returns of a block are stored in arrays, which is faster than an extraction of
  // single numbers from packs.
  static void collect(const RangeImageGrid& grid, const Scan& scan, PointsView points,
                      Span<const std::uint8_t> moving, Scratch& scratch) {
    const ImageLocator locator(grid);
    std::int32_t* const nearest = scratch.returns.data();
    static constexpr detail::PackConstant kMaxMetres(kMaxRange), kScale(kCentimetres),
        kFine(kPlaces), kFirst(0.0F), kLast(kPlaces - 1);
    detail::with_packs([&](auto packs) {
      using Packs = decltype(packs);
      using Float = typename Packs::Float;
      using Int = typename Packs::Int;
      std::int32_t cell[detail::kStepPoints];
      std::int32_t value[detail::kStepPoints];
      for (std::size_t begin = 0; begin < points.size(); begin += detail::kStepPoints) {
        const std::size_t size = std::min(detail::kStepPoints, points.size() - begin);
        detail::for_slices<Packs>(0, size, [&](auto place) {
          Float x = place.load(points.x.data() + begin);
          Float y = place.load(points.y.data() + begin);
          Float z = place.load(points.z.data() + begin);
          if (scan.to_image) {
            const Float px = x, py = y, pz = z;
            x = (*scan.to_image)(0, px, py, pz);
            y = (*scan.to_image)(1, px, py, pz);
            z = (*scan.to_image)(2, px, py, pz);
          }
          const Float metres = sqrt((x * x + y * y) + z * z);
          const auto located = locator.template locate<Packs>(x, y, z, metres);
          const auto byte = [](const Float& within) {
            return truncate(max(min(within * kFine, Float(kLast)), Float(kFirst)));
          };
          const Int centimetres = truncate(min(metres, Float(kMaxMetres)) * kScale) & Int(~kMoving);
          located.cell.store(&cell[place.begin]);
          ((centimetres << 16) + (byte(located.column) << 8) + byte(located.row))
              .store(&value[place.begin]);
        });
        if (!moving.empty()) {
          for (std::size_t i = 0; i < size; ++i) {
            value[i] |= (moving[begin + i] & kMoving) << 16;
          }
        }
        // Points outside the image have cell 0, a cell of the border that is not read.
        for (std::size_t i = 0; i < size; ++i) {
          std::int32_t& least = nearest[cell[i]];
          least = std::min(least, value[i]);
        }
      }
    });
  }

  template <class Short>
  static Short is_moving(const Short& range) {
    return (range & Short(kMoving)) == Short(kMoving);
  }
  // Keeps ranges of moving points only, or of static points only; replaces others by kNothing.
  template <class Short>
  static Short only_moving(const Short& range) {
    return select(is_moving(range), range, Short(kNothing));
  }
  template <class Short>
  static Short only_staying(const Short& range) {
    return select(is_moving(range), Short(kNothing), range);
  }

  // Copies the returns of static objects, before the ground is added to the image.
  static void keep_objects(Scratch& scratch) {
    const std::size_t count = scratch.returns.size();
    detail::grow(scratch.objects, count);
    const std::int32_t* const from = scratch.returns.data();
    std::int16_t* const objects = scratch.objects.data();
    detail::with_packs([&](auto) {
      for (std::size_t i = 0; i < count; ++i) {
        const auto range = static_cast<std::int16_t>(from[i] >> 16);
        objects[i] = (range & kMoving) != 0 ? kNothing : range;
      }
    });
  }

  // Splits the returns into ranges and beams.
  void split(Scratch& scratch) {
    const std::size_t count = scratch.returns.size();
    detail::grow(scratch.nearest, count);
    const std::int32_t* const from = scratch.returns.data();
    std::int16_t* const nearest = scratch.nearest.data();
    Beam* const beams = beams_.get();
    detail::with_packs([&](auto) {
      for (std::size_t i = 0; i < count; ++i) nearest[i] = static_cast<std::int16_t>(from[i] >> 16);
      for (std::size_t i = 0; i < count; ++i) beams[i] = static_cast<Beam>(from[i]);
    });
  }

  // Fills gaps of up to `hole_rows` empty rows between two beams with the nearer return of the rows
  // below and above.
  static void close_holes(const RangeImageGrid& grid, Scratch& scratch) {
    using namespace detail;
    const std::size_t stride = grid.stride();
    // By column: the last return below the row, and the number of empty rows above that return.
    scratch.below.assign(stride, kNothing);
    scratch.gap.assign(stride, static_cast<std::int16_t>(grid.hole_rows + 1));
    with_packs([&](auto packs) {
      using Short = typename decltype(packs)::Short;
      const Short zero(0), one(1), nothing(kNothing);
      const Short widest(static_cast<std::int16_t>(grid.hole_rows));
      std::int16_t* const belows = scratch.below.data();
      std::int16_t* const gaps = scratch.gap.data();
      for (std::size_t row = 0; row < static_cast<std::size_t>(grid.rows); ++row) {
        std::int16_t* const line = &scratch.nearest[row * stride];
        for (std::size_t column = kPackWidth; column + kPackWidth < stride;
             column += kShortPackWidth) {
          std::int16_t* const at = line + column;
          const Short here = Short::load(at);
          const Short below = Short::load(belows + column);
          const Short gap = Short::load(gaps + column);
          const Short returned = here < nothing;
          const Short closes = returned & (zero < gap) & (gap < widest + one);
          if (closes.any()) {
            const Short fill = min(here, below);
            std::int16_t* to = at;
            for (Short left = closes & gap; (zero < left).any(); left = left - one) {
              to -= stride;
              select(zero < left, fill, Short::load(to)).store(to);
            }
          }
          select(returned, here, below).store(belows + column);
          (~returned & min(gap + one, widest + one)).store(gaps + column);
        }
      }
    });
  }

  // Writes the cells of the image from the nearest returns of their 3x3 cells.
  void store_with_least_around(const RangeImageGrid& grid, Scratch& scratch) {
    const std::size_t stride = grid.stride();
    const auto rows = static_cast<std::size_t>(grid.rows);
    scratch.least.resize(stride);
    scratch.min_moving.resize(stride);
    scratch.count.resize(stride);
    for (std::size_t row = 0; row < rows; ++row) {
      wrap(&scratch.nearest[row * stride], static_cast<std::size_t>(grid.columns));
    }
    detail::with_packs([&](auto packs) {
      using Short = typename decltype(packs)::Short;
      for (std::size_t row = 0; row < rows; ++row) {
        merge_three_rows<Short>(grid, row, scratch);
        store_row<Short>(grid, row, scratch);
      }
    });
  }

  // A row of `image`, a buffer of `scratch`; a row of kNothing if `row` lies outside the grid.
  static const std::int16_t* row_of(const std::vector<std::int16_t>& image, std::size_t row,
                                    const RangeImageGrid& grid, const Scratch& scratch) {
    return row < static_cast<std::size_t>(grid.rows) ? &image[row * grid.stride()]
                                                     : scratch.border.data();
  }

  // Computes for each column of three rows: the nearest static return, the nearest moving return,
  // and the negative number of static returns.
  template <class Short>
  static void merge_three_rows(const RangeImageGrid& grid, std::size_t row, Scratch& scratch) {
    const Short nothing(kNothing);
    const std::size_t stride = grid.stride();
    const std::int16_t* const low = row_of(scratch.nearest, row - 1, grid, scratch);
    const std::int16_t* const middle = row_of(scratch.nearest, row, grid, scratch);
    const std::int16_t* const high = row_of(scratch.nearest, row + 1, grid, scratch);
    std::int16_t* const leasts = scratch.least.data();
    std::int16_t* const moving_leasts = scratch.min_moving.data();
    std::int16_t* const counts = scratch.count.data();
    for (std::size_t column = 0; column < stride; column += detail::kShortPackWidth) {
      const Short below = Short::load(low + column);
      const Short here = Short::load(middle + column);
      const Short above = Short::load(high + column);
      min(min(only_moving(below), only_moving(here)), only_moving(above))
          .store(moving_leasts + column);
      const Short a = only_staying(below);
      const Short b = only_staying(here);
      const Short c = only_staying(above);
      min(min(a, b), c).store(leasts + column);
      // The number of a set mask is -1.
      ((a < nothing) + (b < nothing) + (c < nothing)).store(counts + column);
    }
  }

  // The least of the numbers at a place of a row and at both places beside it.
  template <class Short>
  static Short least_of_three(const std::int16_t* at) {
    return min(min(Short::load(at - 1), Short::load(at)), Short::load(at + 1));
  }

  // Writes one row of cells. A cell is unknown if its 3x3 cells have a single static return, or if
  // no beam crosses it.
  template <class Short>
  void store_row(const RangeImageGrid& grid, std::size_t row, const Scratch& scratch) {
    const Short nothing(kNothing), unknown(kUnknown), zero(0), one_return(-1);
    const std::size_t stride = grid.stride();
    const std::int16_t* const middle = row_of(scratch.nearest, row, grid, scratch);
    const std::int16_t* const leasts = scratch.least.data();
    const std::int16_t* const moving_leasts = scratch.min_moving.data();
    const std::int16_t* const counts = scratch.count.data();
    Cell* const cells = &cells_[row * stride];
    for (std::size_t column = detail::kPackWidth; column + detail::kPackWidth < stride;
         column += detail::kShortPackWidth) {
      const std::int16_t* const count = counts + column;
      const Short returns = Short::load(count - 1) + Short::load(count) + Short::load(count + 1);
      const Short here = Short::load(middle + column);
      const Short is_crossed = (here < nothing) | ((Short::load(middle + column - 1) < nothing) &
                                                   (Short::load(middle + column + 1) < nothing));
      const Short known = (returns < one_return) & is_crossed;
      const Short staying = select(known, least_of_three<Short>(leasts + column), unknown);
      // A moving point in the cell itself occludes the points behind it.
      const Short hiding = min(select(staying < zero, nothing, staying), here);
      const Short around = select(is_moving(here), hiding, staying);
      const Short moving = least_of_three<Short>(moving_leasts + column);
      const Short nearest = select(moving < nothing, moving, here);
      nearest.store_interleaved_with(around, &cells[column].nearest);
    }
  }

  // Extends the protection of near objects beyond their 3x3 cells: cell by cell, as far as the
  // objects are near enough.
  void widen(const RangeImageGrid& grid, float reach, Scratch& scratch) {
    constexpr int kWidest = 4;  // cells on each side
    scratch.wider.assign(grid.cell_count(), kNothing);
    detail::with_packs([&](auto packs) {
      for (int cells = 1; cells <= kWidest; ++cells) {
        // Farther returns protect no more than their 3x3 cells, the first step.
        const float width = static_cast<float>(std::max(cells, 2)) - 0.5F;
        const float farthest = reach * grid.columns_per_radian / width;
        const auto limit = static_cast<std::int16_t>(std::min(farthest, kMaxRange) * kCentimetres);
        for (std::size_t row = 0; row < static_cast<std::size_t>(grid.rows); ++row) {
          widen_row<typename decltype(packs)::Short>(grid, row, limit, cells > 1, scratch);
        }
        scratch.objects.swap(scratch.wider);
      }
    });
  }

  // Writes one row of `wider`: the least of the 3x3 cells of `objects`, or kNothing if it is not
  // below `limit` (cm). If `protects`, this least range limits Cell::around.
  template <class Short>
  void widen_row(const RangeImageGrid& grid, std::size_t row, std::int16_t limit, bool protects,
                 Scratch& scratch) {
    const Short nothing(kNothing), most(limit);
    const std::size_t stride = grid.stride();
    Short least_of_row = nothing;
    std::int16_t* const wider = &scratch.wider[row * stride];
    const std::int16_t* const low = row_of(scratch.objects, row - 1, grid, scratch);
    const std::int16_t* const middle = row_of(scratch.objects, row, grid, scratch);
    const std::int16_t* const high = row_of(scratch.objects, row + 1, grid, scratch);
    std::int16_t* const leasts = scratch.least.data();
    for (std::size_t column = 0; column < stride; column += detail::kShortPackWidth) {
      const Short least = min(min(Short::load(low + column), Short::load(middle + column)),
                              Short::load(high + column));
      least_of_row = min(least_of_row, least);
      select(least < most, least, nothing).store(leasts + column);
    }
    if (!(least_of_row < most).any()) {
      std::fill_n(wider, stride, kNothing);
      return;
    }
    wrap(leasts, static_cast<std::size_t>(grid.columns));
    Cell* const cells = &cells_[row * stride];
    for (std::size_t column = detail::kPackWidth; column + detail::kPackWidth < stride;
         column += detail::kShortPackWidth) {
      const Short least = least_of_three<Short>(leasts + column);
      least.store(wider + column);
      if (protects && (least < nothing).any()) protect(cells + column, least);
    }
  }

  // Limits Cell::around of the known cells of one group to `reach`.
  template <class Short>
  static void protect(Cell* cells, const Short& reach) {
    using namespace detail;
    std::int16_t limits[2 * kShortPackWidth];
    Short(kNothing).store_interleaved_with(reach, limits);
    for (std::size_t half = 0; half < 2; ++half) {
      std::int16_t* const at = &cells[half * kShortPackWidth / 2].nearest;
      min(Short::load(at), Short::load(limits + half * kShortPackWidth)).store(at);
    }
  }

  // Copies the cell at each end of a row beyond its other end: the neighbours across the seam.
  static void wrap(std::int16_t* row, std::size_t columns) {
    std::int16_t* const first = row + detail::kPackWidth;
    first[-1] = first[columns - 1];
    first[columns] = first[0];
  }

  std::unique_ptr<Cell[]> cells_;
  std::unique_ptr<Beam[]> beams_;
  std::size_t capacity_ = 0;  // cells
  RangeImageGrid grid_;
};

}  // namespace dynains
