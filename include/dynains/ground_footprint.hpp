// Which ground points lie below or beside removed points.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "dynains/detail/room.hpp"
#include "dynains/detail/wide_lanes.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// Horizontal extent of some points, m.
struct GroundBox {
  float x_min, x_max, y_min, y_max;
};

/// Horizontal grid around the sensor that remembers where points were removed and how low, and a
/// coarse one beside it that tells quickly which points are near them.
class GroundFootprint {
 public:
  /// `cell`: m, points reach into the cells around theirs; `reach`: m, the same for what counts as
  /// near; `max_range`: m, points beyond are not remembered.
  GroundFootprint(double cell, double reach, double max_range)
      : cell_(static_cast<float>(cell)),
        fine_(cell, max_range),
        coarse_(reach, max_range),
        tile_of_(tile_count(fine_.width()), 0),
        tiles_(1),
        near_(coarse_.cell_count(), 0) {
    tiles_.reserve(tile_of_.size() + 1);  // takes address space only
    used_.reserve(tile_of_.size());
  }

  /// Remembers a removed point; seen after spread().
  void add(float x, float y, float z) {
    const Place place = fine_.place(x, y);
    if (!place.inside) return;
    Cell& cell = cell_at(place.column, place.row);
    const bool is_first = !(cell.own < kNothing);
    cell.own = std::min(cell.own, z);
    if (is_first && cell.own < kNothing) touched_.push_back(place);
  }

  /// Lets what was added reach into the cells around.
  void spread() {
    for (const Place& place : touched_) {
      const float own = cell_at(place.column, place.row).own;
      for_around(place, [&](std::uint32_t column, std::uint32_t row) {
        Cell& cell = cell_at(column, row);
        cell.lowest = std::min(cell.lowest, own);
      });
      const Place near =
          coarse_.place(fine_.centre(place.column) * cell_, fine_.centre(place.row) * cell_);
      if (!near.inside) continue;
      for_around(near, [&](std::uint32_t column, std::uint32_t row) {
        near_[row * coarse_.width() + column] = 1;
      });
    }
  }

  /// The extent of every 64 points, to be found once for all calls of visit_near().
  static void bound(PointsView points, std::vector<GroundBox>& boxes) {
    const std::size_t count = (points.size() + kBlock - 1) / kBlock;
    detail::make_room(boxes, count);
    boxes.resize(count);
    detail::run_lanes([&](auto lanes) {
      using Lanes = decltype(lanes);
      using Float = typename Lanes::Float;
      for (std::size_t b = 0; b < boxes.size(); ++b) {
        const std::size_t begin = b * kBlock;
        const PointsView block = points.subview(begin, std::min(kBlock, points.size() - begin));
        const detail::Constant8 first_x(block.x[0]), first_y(block.y[0]);
        Float x_min = first_x, x_max = first_x, y_min = first_y, y_max = first_y;
        detail::for_places<Lanes>(block.size(), [&](const auto& at) {
          const Float x = at.there(at.load(block.x.data()), first_x);
          const Float y = at.there(at.load(block.y.data()), first_y);
          x_min = min(x_min, x);
          x_max = max(x_max, x);
          y_min = min(y_min, y);
          y_max = max(y_max, y);
        });
        boxes[b] = {min_lane(x_min), max_lane(x_max), min_lane(y_min), max_lane(y_max)};
      }
    });
  }

  /// Calls `visit(begin, near, under)` for up to 64 points from `begin` on at a time, a bit each:
  /// those near a removed point (and some at the border of the grid), and which of these lie under
  /// one, less than `clearance` (m) below the lowest that was removed about there. `boxes`: of
  /// bound().
  template <class Visitor>
  void visit_near(PointsView points, Span<const GroundBox> boxes, float clearance,
                  Visitor&& visit) const {
    for (std::size_t begin = 0; begin < points.size(); begin += kBlock) {
      if (!is_near(boxes[begin / kBlock])) continue;
      const PointsView block = points.subview(begin, std::min(kBlock, points.size() - begin));
      const std::uint64_t near = find_near(block);
      if (near != 0) visit(begin, near, near & find_under(block, clearance));
    }
  }

  bool empty() const { return touched_.empty(); }

  /// Forgets all points.
  void clear() {
    for (const std::uint32_t tile : used_) tile_of_[tile] = 0;
    used_.clear();
    touched_.clear();
    std::fill(near_.begin(), near_.end(), std::uint8_t{0});
  }

 private:
  static constexpr float kNothing = std::numeric_limits<float>::infinity();
  static constexpr int kTileShift = 3;
  static constexpr std::uint32_t kTile = 1U << kTileShift;  // cells along a side
  static constexpr std::size_t kBlock = 64;  // points that are looked at together, a bit each

  struct Place {
    std::uint32_t column, row;
    bool inside;
  };
  struct Cell {
    float own = kNothing;     // lowest point in it
    float lowest = kNothing;  // the same with the cells around
  };
  // Few tiles are in use at a time, so that they stay in the nearest cache; tile 0 is empty.
  using Tile = std::array<Cell, std::size_t{kTile} * kTile>;

  static std::size_t tile_count(std::uint32_t width) {
    const std::size_t side = width / kTile + 1;
    return side * side;
  }

  // Square cells about the sensor, within a border of cells that only their neighbours reach.
  class Grid {
   public:
    Grid(double cell, double max_range)
        : per_metre_(static_cast<float>(1.0 / cell)),
          half_(static_cast<std::uint32_t>(std::ceil(max_range / cell)) + 2) {}

    std::uint32_t width() const { return 2 * half_; }
    std::size_t cell_count() const { return std::size_t{width()} * width(); }
    Place place(float x, float y) const {
      const auto centre = static_cast<float>(half_);
      const auto last = static_cast<float>(width() - 1);
      const float column = x * per_metre_ + centre;
      const float row = y * per_metre_ + centre;
      if (!(column >= 1.0F && column < last && row >= 1.0F && row < last)) return {0, 0, false};
      return {static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row), true};
    }
    /// Rows or columns of eight points; what lies outside falls into the border.
    template <class Float>
    auto line(const Float& coordinate) const {
      static constexpr detail::Constant8 kZero(0.0F);
      const Float centre(detail::Constant8(static_cast<float>(half_)));
      const Float last(detail::Constant8(static_cast<float>(width() - 1)));
      const Float per_metre = detail::Constant8(per_metre_);
      return truncate(min(max(coordinate * per_metre + centre, Float(kZero)), last));
    }
    /// The same of one point.
    std::size_t index(float coordinate) const {
      const float place = coordinate * per_metre_ + static_cast<float>(half_);
      return static_cast<std::size_t>(
          std::min(std::max(place, 0.0F), static_cast<float>(width() - 1)));
    }
    /// Row-major.
    template <class Float>
    auto indices(const Float& x, const Float& y) const {
      // Exact in floats: coarse grids have fewer than 2^24 cells.
      const Float cells(detail::Constant8(static_cast<float>(width())));
      return truncate(to_float(line(y)) * cells + to_float(line(x)));
    }
    /// Of a row or column, in cells from the sensor.
    float centre(std::uint32_t index) const {
      return (static_cast<float>(index) + 0.5F) - static_cast<float>(half_);
    }

   private:
    float per_metre_;
    std::uint32_t half_;  // cells
  };

  template <class Visitor>
  static void for_around(const Place& place, Visitor&& visitor) {
    for (std::uint32_t row = place.row - 1; row <= place.row + 1; ++row) {
      for (std::uint32_t column = place.column - 1; column <= place.column + 1; ++column) {
        visitor(column, row);
      }
    }
  }

  // Whether some point within may be near: rows of the coarse grid, a few cells long.
  bool is_near(const GroundBox& box) const {
    const std::size_t first = coarse_.index(box.x_min);
    const std::size_t last = coarse_.index(box.x_max);
    for (std::size_t row = coarse_.index(box.y_min); row <= coarse_.index(box.y_max); ++row) {
      const std::uint8_t* const cells = &near_[row * coarse_.width()];
      for (std::size_t column = first; column <= last; ++column) {
        if (cells[column] != 0) return true;
      }
    }
    return false;
  }

  // Which points of a block are near.
  std::uint64_t find_near(PointsView block) const {
    std::int32_t cell[kBlock];
    detail::for_lanes(block.size(), [&](auto at) {
      coarse_.indices(at.load(block.x.data()), at.load(block.y.data())).store(&cell[at.begin]);
    });
    std::uint64_t near = 0;
    for (std::size_t i = 0; i < block.size(); ++i) {
      near |= std::uint64_t{near_[static_cast<std::size_t>(cell[i])]} << i;
    }
    return near;
  }

  // Which points of a block lie under something removed.
  std::uint64_t find_under(PointsView block, float clearance) const {
    static constexpr detail::Constant8 kNever(-kNothing);
    const detail::Constant8 above(clearance);
    const auto side = static_cast<std::int32_t>(tiles_along_side());
    const auto border = static_cast<std::int32_t>(fine_.width()) - 1;
    std::int32_t tile_of_point[kBlock];
    std::int32_t cell[kBlock];
    float height[kBlock];
    detail::for_lanes(block.size(), [&](auto at) {
      using Int = typename decltype(at)::Int;
      using Float = typename decltype(at)::Float;
      const Int column = fine_.line(at.load(block.x.data()));
      const Int row = fine_.line(at.load(block.y.data()));
      const Int last(static_cast<std::int32_t>(kTile) - 1);
      (multiply(row >> kTileShift, side) + (column >> kTileShift)).store(&tile_of_point[at.begin]);
      (((row & last) << kTileShift) + (column & last)).store(&cell[at.begin]);
      const Int zero(0), end(border);
      const auto inside = (zero < column) & (column < end) & (zero < row) & (row < end);
      select(inside, at.load(block.z.data()) + Float(above), Float(kNever))
          .store(&height[at.begin]);
    });
    std::uint64_t under = 0;
    for (std::size_t i = 0; i < block.size(); ++i) {
      const Tile& tile = tiles_[tile_of_[static_cast<std::size_t>(tile_of_point[i])]];
      under |= std::uint64_t{tile[static_cast<std::size_t>(cell[i])].lowest < height[i]} << i;
    }
    return under;
  }

  std::size_t tiles_along_side() const { return fine_.width() / kTile + 1; }
  std::size_t tile(std::uint32_t column, std::uint32_t row) const {
    return row / kTile * tiles_along_side() + column / kTile;
  }
  static std::size_t within(std::uint32_t column, std::uint32_t row) {
    return row % kTile * kTile + column % kTile;
  }
  Cell& cell_at(std::uint32_t column, std::uint32_t row) {
    std::uint32_t& number = tile_of_[tile(column, row)];
    if (number == 0) {
      used_.push_back(static_cast<std::uint32_t>(tile(column, row)));
      number = static_cast<std::uint32_t>(used_.size());
      if (number == tiles_.size()) tiles_.emplace_back();
      tiles_[number].fill(Cell());
    }
    return tiles_[number][within(column, row)];
  }

  float cell_;
  Grid fine_;
  Grid coarse_;
  std::vector<std::uint32_t> tile_of_;  // row-major; 0 where nothing is near
  std::vector<std::uint32_t> used_;     // what is not 0 there
  std::vector<Tile> tiles_;
  std::vector<std::uint8_t> near_;  // by coarse cell
  std::vector<Place> touched_;      // cells of points, each once
};

}  // namespace dynains
