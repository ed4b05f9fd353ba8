// Cells of the world with points of a scan.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/simd/floor.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// Index of a square tile, along x and y of the world.
using GroundTile = std::array<std::int64_t, 2>;

inline constexpr double kWorldCell = 0.4;  ///< m, a cube
inline constexpr int kTileShift = 6;       ///< a tile has 64 x 64 columns
inline constexpr std::int64_t kTileCells = std::int64_t{1} << kTileShift;
inline constexpr double kTileEdge = kWorldCell * static_cast<double>(kTileCells);  ///< m

/// Indices of a cell along x, y and z of the world.
using WorldCell = std::array<std::int64_t, 3>;

// Arithmetic shifts and masks are floor division and remainder.
inline GroundTile tile_of(const WorldCell& cell) {
  return {cell[0] >> kTileShift, cell[1] >> kTileShift};
}
/// Key of a cell in its tile.
inline VoxelKey key_of(const WorldCell& cell) {
  return voxel_key(cell[0] & (kTileCells - 1), cell[1] & (kTileCells - 1), cell[2]);
}

/// The cell of a point, m, world frame.
inline WorldCell cell_at(const Eigen::Vector3d& point) {
  WorldCell cell;
  for (int axis = 0; axis < 3; ++axis) {
    const double index = std::floor(point[axis] / kWorldCell);
    cell[static_cast<std::size_t>(axis)] = static_cast<std::int64_t>(index);
  }
  return cell;
}

/// Point i (m, sensor frame) of a scan, m, world frame.
inline Eigen::Vector3d world_point(PointsView points, std::size_t i, const Pose& T_world_sensor) {
  return T_world_sensor * Eigen::Vector3d(static_cast<double>(points.x[i]),
                                          static_cast<double>(points.y[i]),
                                          static_cast<double>(points.z[i]));
}

/// Points of a scan that are worked on together: the memory of their cells is fetched at once.
class LocatedPoints {
 public:
  static constexpr std::size_t kMost = 64;

  /// Successive points, from `begin` to before `end`, in one cell.
  struct Run {
    WorldCell cell;
    std::size_t begin, end;
  };

  std::size_t size() const { return size_; }
  Span<const Run> runs() const { return {runs_.data(), run_count_}; }
  /// Number of point k in its scan.
  std::size_t point(std::size_t k) const { return points_[k]; }
  /// m, world frame.
  Eigen::Vector3d at(std::size_t k) const {
    return {axes_[0].world[k], axes_[1].world[k], axes_[2].world[k]};
  }
  /// Place of the point in its cell along an axis, in 1/256 of a cell.
  std::uint8_t within(std::size_t axis, std::size_t k) const {
    return static_cast<std::uint8_t>(axes_[axis].within[k]);
  }

  void clear() { size_ = run_count_ = 0; }
  /// `at`: m, sensor frame. There must be room for it.
  void add(std::size_t point, const std::array<float, 3>& at) {
    points_[size_] = point;
    for (std::size_t axis = 0; axis < 3; ++axis) axes_[axis].local[size_] = at[axis];
    ++size_;
  }
  /// Finds the cells of all points, and their runs.
  void locate(const Pose& T_world_sensor) {
    detail::with_packs([&](auto) {
      for (int row = 0; row < 3; ++row) {
        locate(axes_[static_cast<std::size_t>(row)], T_world_sensor(row, 0), T_world_sensor(row, 1),
               T_world_sensor(row, 2), T_world_sensor(row, 3));
      }
    });
    for (std::size_t k = 0; k < size_; ++k) {
      const bool goes_on = k > 0 && axes_[0].cell[k] == axes_[0].cell[k - 1] &&
                           axes_[1].cell[k] == axes_[1].cell[k - 1] &&
                           axes_[2].cell[k] == axes_[2].cell[k - 1];
      if (!goes_on) {
        runs_[run_count_++] = {{axes_[0].cell[k], axes_[1].cell[k], axes_[2].cell[k]}, k, k};
      }
      runs_[run_count_ - 1].end = k + 1;
    }
  }

 private:
  struct Axis {
    std::array<float, kMost> local = {};   // m, sensor frame
    std::array<double, kMost> world = {};  // m, world frame
    std::array<std::int32_t, kMost> cell = {}, within = {};
  };

  // Coordinates in the order of world_point().
  void locate(Axis& axis, double from_x, double from_y, double from_z, double origin) const {
    for (std::size_t k = 0; k < kMost; ++k) {
      axis.world[k] = from_x * static_cast<double>(axes_[0].local[k]) +
                      from_y * static_cast<double>(axes_[1].local[k]) +
                      from_z * static_cast<double>(axes_[2].local[k]) + origin;
    }
    for (std::size_t k = 0; k < kMost; ++k) {
      const double cells = axis.world[k] / kWorldCell;
      const auto cell = detail::floor_to<std::int32_t>(cells);
      const auto within = static_cast<std::int32_t>(256.0 * (cells - static_cast<double>(cell)));
      axis.cell[k] = cell;
      axis.within[k] = within - (within >> 8);  // 256 by rounding is 255; std::min() is no vector
    }
  }

  std::size_t size_ = 0, run_count_ = 0;
  std::array<std::size_t, kMost> points_ = {};
  std::array<Axis, 3> axes_;
  std::array<Run, kMost> runs_;
};

/// Calls `visit(located)` for the points (m, sensor frame) of which `is_taken(i)`, in their order.
template <class IsTaken, class Visitor>
void for_each_located(PointsView points, const Pose& T_world_sensor, IsTaken&& is_taken,
                      Visitor&& visit) {
  LocatedPoints located;
  const auto end = [&] {
    located.locate(T_world_sensor);
    visit(located);
    located.clear();
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!is_taken(i)) continue;
    located.add(i, {points.x[i], points.y[i], points.z[i]});
    if (located.size() == LocatedPoints::kMost) end();
  }
  if (located.size() > 0) end();
}

}  // namespace dynains
