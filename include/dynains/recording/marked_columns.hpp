// Columns of the world that points of a scan are looked for in.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/world_cells.hpp"
#include "dynains/simd/pack_geometry.hpp"

namespace dynains {

/// Most points of a scan are in no column that matters: they are found in single precision, and
/// their places need not be looked for.
class MarkedColumns {
 public:
  /// Marks the column of a cell, and those that touch it.
  void mark(const WorldCell& cell) {
    // One column more: for the rounding of find().
    for (std::int64_t x = cell[0] - 2; x <= cell[0] + 2; ++x) {
      for (std::int64_t y = cell[1] - 2; y <= cell[1] + 2; ++y) {
        const auto in_tile = [](std::int64_t i) {
          return static_cast<std::size_t>(i & (kTileCells - 1));
        };
        tiles_[tile_of({x, y, 0})][in_tile(x)] |= std::uint64_t{1} << in_tile(y);
      }
    }
  }

  /// Sets `is_near` to 1 for the points (m, sensor frame) that may be in a marked column, and to 0
  /// for others.
  void find(PointsView points, const Pose& T_world_sensor, std::vector<std::uint8_t>& is_near) {
    const GroundTile sensor = tile_of(cell_at(T_world_sensor.translation()));
    const GroundTile first = {sensor[0] - kAround / 2, sensor[1] - kAround / 2};
    look_around(first);
    Pose T_window_sensor = T_world_sensor;
    for (int axis = 0; axis < 2; ++axis) {
      T_window_sensor(axis, 3) -=
          kTileEdge * static_cast<double>(first[static_cast<std::size_t>(axis)]);
    }
    const detail::PackTransform to_columns(T_window_sensor, 1.0 / kWorldCell);
    x_.resize(points.size() + detail::kPackWidth);
    y_.resize(points.size() + detail::kPackWidth);
    is_near.resize(points.size());
    detail::for_packs(points.size(), [&](auto at) {
      const auto x = at.load(points.x.data());
      const auto y = at.load(points.y.data());
      const auto z = at.load(points.z.data());
      truncate(to_columns(0, x, y, z)).store(&x_[at.begin]);
      truncate(to_columns(1, x, y, z)).store(&y_[at.begin]);
    });
    for (std::size_t i = 0; i < points.size(); ++i) is_near[i] = is_marked(x_[i], y_[i]) ? 1 : 0;
  }

 private:
  static constexpr std::int64_t kAround = 16;  // tiles of the window along an axis
  static constexpr auto kColumns = static_cast<std::uint32_t>(kAround * kTileCells);
  using Bits = std::array<std::uint64_t, kTileCells>;  // by x; a bit for each y

  // Fills the window whose first tile this is.
  void look_around(const GroundTile& first) {
    window_.assign(kColumns * kAround, 0);
    for (auto tile = tiles_.lower_bound(first); tile != tiles_.end(); ++tile) {
      const std::int64_t x = tile->first[0] - first[0], y = tile->first[1] - first[1];
      if (x >= kAround) break;
      if (y < 0 || y >= kAround) continue;
      for (std::int64_t column = 0; column < kTileCells; ++column) {
        window_[static_cast<std::size_t>((x * kTileCells + column) * kAround + y)] =
            tile->second[static_cast<std::size_t>(column)];
      }
    }
  }
  // Columns outside of the window may be marked.
  bool is_marked(std::int32_t x, std::int32_t y) const {
    const auto column = static_cast<std::uint32_t>(x), row = static_cast<std::uint32_t>(y);
    if (column >= kColumns || row >= kColumns) return true;
    return (window_[column * kAround + (row >> kTileShift)] >> (row & (kTileCells - 1)) & 1U) != 0;
  }

  std::map<GroundTile, Bits> tiles_;
  std::vector<std::uint64_t> window_;  // by column along x, and tile along y
  std::vector<std::int32_t> x_, y_;    // columns of the window, by point
};

}  // namespace dynains
