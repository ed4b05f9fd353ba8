// Search for ground points below removed points.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/simd/bits.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

/// Largest height above the ground of the lowest return of an object that stands on it: the greater
/// of `least` and `slope` * horizontal range. The gap between two beams defines `slope`.
struct Clearance {
  float least;  ///< m
  float slope;  ///< m per m
};

/// Bounding box of points in the tiles of a footprint: first and last columns and rows.
struct GroundBox {
  struct Range {
    std::uint16_t first, last;
  };
  Range columns, rows;
};

/// Horizontal grid around the sensor with the height of the lowest removed point per cell. All
/// points are in the sensor frame (m).
class GroundFootprint {
 public:
  /// Number of points per block. Sets of points of a block are words with one bit per point.
  static constexpr std::size_t kBlock = 64;

  /// The block of `points` from index `begin` on; the last block may be shorter.
  static PointsView block_of(PointsView points, std::size_t begin) {
    return points.subview(begin, std::min(kBlock, points.size() - begin));
  }

  /// `cell` (m): edge of the cells. A removed point affects its cell and the eight cells around it.
  /// `max_range` (m): points beyond are ignored.
  GroundFootprint(double cell, double max_range)
      : grid_(cell, max_range), tile_of_(tile_count(grid_.width()), 0), tiles_(1) {
    tiles_.reserve(tile_of_.size() + 1);  // uses address space only
    used_.reserve(tile_of_.size());
  }

  /// Adds a removed point (m). It has an effect after spread().
  void add(float x, float y, float z) {
    const Place place = grid_.place(x, y);
    if (place.inside) add_to(tile(place), within(place), z);
  }

  /// Adds the points of a block whose bits are set in `which`.
  void add(PointsView block, std::uint64_t which) {
    const Located located = locate(block);
    for_each_bit(which & located.inside, [&](std::size_t i) {
      add_to(static_cast<std::uint32_t>(located.tile[i]),
             static_cast<std::uint32_t>(located.cell[i]), block.z[i]);
    });
  }

  /// Updates the cells around all added points.
  void spread() {
    for (const Touched& touched : touched_) {
      const Place place = place_of(touched);
      const float own = cell_at(touched.tile, touched.cell).own;
      for_around(place, [&](const Place& around) {
        Cell& cell = cell_at(tile(around), within(around));
        cell.lowest = std::min(cell.lowest, own);
      });
    }
  }

  /// Computes the box of each block of points, for find_under().
  void bound(PointsView points, std::vector<GroundBox>& boxes) const {
    const std::size_t count = (points.size() + kBlock - 1) / kBlock;
    resize_with_margin(boxes, count);
    with_packs([&](auto packs) {
      using Packs = decltype(packs);
      using Float = typename Packs::Float;
      for (std::size_t b = 0; b < boxes.size(); ++b) {
        const PointsView block = block_of(points, b * kBlock);
        const PackConstant first_x(block.x[0]), first_y(block.y[0]);
        Float x_min = first_x, x_max = first_x, y_min = first_y, y_max = first_y;
        for_slices<Packs>(block.size(), [&](const auto& at) {
          const Float x = at.padded(at.load(block.x.data()), first_x);
          const Float y = at.padded(at.load(block.y.data()), first_y);
          x_min = min(x_min, x);
          x_max = max(x_max, x);
          y_min = min(y_min, y);
          y_max = max(y_max, y);
        });
        boxes[b] = box(smallest(x_min), largest(x_max), smallest(y_min), largest(y_max));
      }
    });
  }

  /// The bits of the points of a block that lie less than `clearance` below the lowest removed
  /// point of the 3x3 cells around them. `box`: result of bound() for the block.
  std::uint64_t find_under(PointsView block, const GroundBox& box,
                           const Clearance& clearance) const {
    return holds(box) ? find_under(block, clearance) : 0;
  }

  bool empty() const { return touched_.empty(); }

  /// Removes all points.
  void clear() {
    for (const std::uint32_t tile : used_) tile_of_[tile] = 0;
    used_.clear();
    touched_.clear();
  }

 private:
  static constexpr float kNothing = std::numeric_limits<float>::infinity();
  static constexpr int kTileShift = 3;
  static constexpr std::uint32_t kTile = 1U << kTileShift;  // cells along a side

  struct Place {
    std::uint32_t column, row;
    bool inside;
  };
  struct Cell {
    float own = kNothing;     // m, height of the lowest removed point in the cell
    float lowest = kNothing;  // m, height of the lowest removed point in its 3x3 cells
  };
  struct Touched {
    std::uint32_t tile, cell;
  };
  // Only few tiles are in use, and these fit into the first-level cache. Tile 0 is empty.
  using Tile = std::array<Cell, std::size_t{kTile} * kTile>;

  static std::size_t tile_count(std::uint32_t width) {
    const std::size_t side = width / kTile + 1;
    return side * side;
  }

  // Square cells around the sensor. The cells at the border contain no points.
  class Grid {
   public:
    Grid(double cell, double max_range)
        : per_metre_(static_cast<float>(1.0 / cell)),
          half_(static_cast<std::uint32_t>(std::ceil(max_range / cell)) + 2) {}

    std::uint32_t width() const { return 2 * half_; }
    Place place(float x, float y) const {
      const auto centre = static_cast<float>(half_);
      const auto last = static_cast<float>(width() - 1);
      const float column = x * per_metre_ + centre;
      const float row = y * per_metre_ + centre;
      if (!(column >= 1.0F && column < last && row >= 1.0F && row < last)) return {0, 0, false};
      return {static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row), true};
    }
    /// Rows (or columns) of points by their coordinates; the border for points outside the grid.
    template <class Float>
    auto line(const Float& coordinate) const {
      static constexpr PackConstant kZero(0.0F);
      const Float centre(PackConstant(static_cast<float>(half_)));
      const Float last(PackConstant(static_cast<float>(width() - 1)));
      const Float per_metre = PackConstant(per_metre_);
      return truncate(min(max(coordinate * per_metre + centre, Float(kZero)), last));
    }
    /// Row (or column) of one point; the border for a point outside the grid.
    std::size_t index(float coordinate) const {
      const float place = coordinate * per_metre_ + static_cast<float>(half_);
      return static_cast<std::size_t>(
          std::min(std::max(place, 0.0F), static_cast<float>(width() - 1)));
    }

   private:
    float per_metre_;
    std::uint32_t half_;  // cells
  };

  template <class Visitor>
  static void for_around(const Place& place, Visitor&& visitor) {
    for (std::uint32_t row = place.row - 1; row <= place.row + 1; ++row) {
      for (std::uint32_t column = place.column - 1; column <= place.column + 1; ++column) {
        visitor(Place{column, row, true});
      }
    }
  }

  GroundBox box(float x_min, float x_max, float y_min, float y_max) const {
    const auto range = [&](float low, float high) {
      return GroundBox::Range{static_cast<std::uint16_t>(grid_.index(low) / kTile),
                              static_cast<std::uint16_t>(grid_.index(high) / kTile)};
    };
    return {range(x_min, x_max), range(y_min, y_max)};
  }

  // Whether any tile of a box is in use.
  bool holds(const GroundBox& box) const {
    for (std::size_t row = box.rows.first; row <= box.rows.last; ++row) {
      const std::uint32_t* const tiles = &tile_of_[row * tiles_along_side()];
      for (std::size_t i = box.columns.first; i <= box.columns.last; ++i) {
        if (tiles[i] != 0) return true;
      }
    }
    return false;
  }

  // By point of a block: its tile and its cell in the tile; bits of the points inside the grid.
  struct Located {
    std::array<std::int32_t, kBlock> tile, cell;
    std::uint64_t inside;
  };
  Located locate(PointsView block) const {
    Located located;
    located.inside = 0;
    const auto side = static_cast<std::int32_t>(tiles_along_side());
    const auto border = static_cast<std::int32_t>(grid_.width()) - 1;
    for_packs(block.size(), [&](auto at) {
      using Int = typename decltype(at)::Int;
      const Int column = grid_.line(at.load(block.x.data()));
      const Int row = grid_.line(at.load(block.y.data()));
      const Int last(static_cast<std::int32_t>(kTile) - 1);
      (multiply(row >> kTileShift, side) + (column >> kTileShift)).store(&located.tile[at.begin]);
      (((row & last) << kTileShift) + (column & last)).store(&located.cell[at.begin]);
      const Int zero(0), end(border);
      const auto inside = (zero < column) & (column < end) & (zero < row) & (row < end);
      located.inside |= std::uint64_t{inside.bits()} << at.begin;
    });
    return located;
  }

  // Bits of the points of a block that lie under a removed point.
  std::uint64_t find_under(PointsView block, const Clearance& clearance) const {
    const Located located = locate(block);
    float top[kBlock];
    const PackConstant least(clearance.least), slope(clearance.slope);
    for_packs(block.size(), [&](auto at) {
      using Float = typename decltype(at)::Float;
      const Float x = at.load(block.x.data());
      const Float y = at.load(block.y.data());
      const Float gap = sqrt(x * x + y * y) * slope;
      (at.load(block.z.data()) + max(gap, Float(least))).store(&top[at.begin]);
    });
    std::uint64_t under = 0;
    for (std::size_t i = 0; i < block.size(); ++i) {
      under |= std::uint64_t{cell_of(located, i).lowest < top[i]} << i;
    }
    return under & located.inside;
  }

  std::uint32_t tiles_along_side() const { return grid_.width() / kTile + 1; }
  std::uint32_t tile(const Place& place) const {
    return place.row / kTile * tiles_along_side() + place.column / kTile;
  }
  static std::uint32_t within(const Place& place) {
    return place.row % kTile * kTile + place.column % kTile;
  }
  Place place_of(const Touched& touched) const {
    const std::uint32_t side = tiles_along_side();
    return {touched.tile % side * kTile + touched.cell % kTile,
            touched.tile / side * kTile + touched.cell / kTile, true};
  }
  void add_to(std::uint32_t tile, std::uint32_t within, float z) {
    Cell& cell = cell_at(tile, within);
    const bool is_first = !(cell.own < kNothing);
    cell.own = std::min(cell.own, z);
    if (is_first && cell.own < kNothing) touched_.push_back({tile, within});
  }
  // The cell of a located point; an empty cell if its tile is not in use.
  const Cell& cell_of(const Located& located, std::size_t i) const {
    return tiles_[tile_of_[static_cast<std::size_t>(located.tile[i])]]
                 [static_cast<std::size_t>(located.cell[i])];
  }
  Cell& cell_at(std::uint32_t tile, std::uint32_t within) {
    std::uint32_t& number = tile_of_[tile];
    if (number == 0) {
      used_.push_back(tile);
      number = static_cast<std::uint32_t>(used_.size());
      if (number == tiles_.size()) tiles_.emplace_back();
      tiles_[number].fill(Cell());
    }
    return tiles_[number][within];
  }

  Grid grid_;
  std::vector<std::uint32_t> tile_of_;  // row-major: index in tiles_, or 0
  std::vector<std::uint32_t> used_;     // indices of the non-zero entries of tile_of_
  std::vector<Tile> tiles_;
  std::vector<Touched> touched_;  // cells with removed points, each once
};

}  // namespace dynains::detail
