// Which ground points lie below or beside removed points.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "dynains/detail/wide_lanes.hpp"
#include "dynains/points.hpp"

namespace dynains {

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
    if (!(z < cell.own)) return;
    if (!(cell.own < kNothing)) touched_.push_back(place);
    cell.own = z;
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

  /// Calls `visit(i, lowest)` for all points that are near a removed point, and for some at the
  /// border of the grid, in order; `lowest` is the height of the lowest point that was removed
  /// about there, or infinity.
  template <class Visitor>
  void visit_near(PointsView points, Visitor&& visit) const {
    std::int32_t column[kBlock];
    std::int32_t row[kBlock];
    for (std::size_t begin = 0; begin < points.size(); begin += kBlock) {
      const PointsView block = points.subview(begin, std::min(kBlock, points.size() - begin));
      std::uint64_t near = find_near(block);
      if (near == 0) continue;
      detail::for_lanes(block.size(), [&](auto at) {
        fine_.line(at.load(block.x.data())).store(&column[at.begin]);
        fine_.line(at.load(block.y.data())).store(&row[at.begin]);
      });
      for (; near != 0; near &= near - 1) {
        const auto i = static_cast<std::size_t>(__builtin_ctzll(near));
        visit(begin + i, lowest(column[i], row[i]));
      }
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
  static constexpr std::uint32_t kTile = 8;  // cells along a side
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

  float lowest(std::int32_t column, std::int32_t row) const {
    const auto last = static_cast<std::int32_t>(fine_.width()) - 1;
    if (column < 1 || row < 1 || column >= last || row >= last) return kNothing;
    const auto c = static_cast<std::uint32_t>(column);
    const auto r = static_cast<std::uint32_t>(row);
    return tiles_[tile_of_[tile(c, r)]][within(c, r)].lowest;
  }

  std::size_t tile(std::uint32_t column, std::uint32_t row) const {
    return row / kTile * (fine_.width() / kTile + 1) + column / kTile;
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
