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

  /// Height of the lowest point that was removed about here, or infinity.
  float lowest(float x, float y) const {
    const Place place = fine_.place(x, y);
    if (!place.inside) return kNothing;
    return tiles_[tile_of_[tile(place.column, place.row)]][within(place.column, place.row)].lowest;
  }

  /// Numbers of all points that are near a removed point, and of some at the border of the grid,
  /// into `found`; in order.
  void find(PointsView points, std::vector<std::uint32_t>& found) const {
    using namespace detail;
    if (found.size() < points.size() + kLanes) found.resize(points.size() + kLanes);
    std::size_t count = 0;
    for_lanes(points.size(), [&](auto at) {
      std::int32_t cell[kLanes];
      coarse_.indices(at.load(points.x.data()), at.load(points.y.data())).store(cell);
      unsigned any = 0;
      for (const std::int32_t index : cell) any |= near_at(index);
      if (any == 0) return;
      for (std::size_t lane = 0; lane < at.size(); ++lane) {
        found[count] = static_cast<std::uint32_t>(at.begin + lane);
        count += near_at(cell[lane]);
      }
    });
    found.resize(count);
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
    /// Row-major; what lies outside falls into the border.
    template <class Float>
    auto indices(const Float& x, const Float& y) const {
      static constexpr detail::Constant8 kZero(0.0F);
      const Float centre(detail::Constant8(static_cast<float>(half_)));
      const Float last(detail::Constant8(static_cast<float>(width() - 1)));
      const Float per_metre = detail::Constant8(per_metre_);
      const auto line = [&](const Float& coordinate) {
        return to_float(truncate(min(max(coordinate * per_metre + centre, Float(kZero)), last)));
      };
      // Exact in floats: coarse grids have fewer than 2^24 cells.
      const Float cells(detail::Constant8(static_cast<float>(width())));
      return truncate(line(y) * cells + line(x));
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
  unsigned near_at(std::int32_t cell) const { return near_[static_cast<std::size_t>(cell)]; }

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
