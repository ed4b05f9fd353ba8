// Cells of the world with points of a scan.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// Index of a square tile, along x and y of the world.
using TileIndex = std::array<std::int64_t, 2>;

inline constexpr double kWorldCell = 0.4;  ///< m, a cube
inline constexpr int kTileShift = 6;       ///< a tile has 64 x 64 columns
inline constexpr double kTileEdge = kWorldCell * static_cast<double>(1 << kTileShift);  ///< m

inline constexpr double kTestRange = 60.0;  ///< m, horizontal, from the sensor to what it tests

/// The tile of a cell.
inline TileIndex tile_of(VoxelKey cell) {
  return {voxel_index(cell, 0) >> kTileShift, voxel_index(cell, 1) >> kTileShift};
}

/// The cell of a point, m, world frame.
inline VoxelKey cell_at(const Eigen::Vector3d& point) { return voxel_at(point, kWorldCell); }

/// The cube of 2 x 2 x 2 voxels around a voxel.
inline VoxelKey block_of(VoxelKey voxel) {
  const auto half = [&](int axis) { return voxel_index(voxel, axis) >> 1; };
  return voxel_key(half(0), half(1), half(2));
}

/// Which one of the voxels of its block a voxel is: bit 0 for the upper one along x, 1 y, 2 z.
inline unsigned octant_of(VoxelKey voxel) {
  const auto bit = [&](int axis) { return static_cast<unsigned>(voxel_index(voxel, axis) & 1); };
  return bit(0) | bit(1) << 1U | bit(2) << 2U;
}

/// The corner of a cell with the lowest coordinates, m. `edge`: m, of the cells.
inline Eigen::Vector3d corner_of(VoxelKey cell, double edge = kWorldCell) {
  const auto at = [&](int axis) { return edge * static_cast<double>(voxel_index(cell, axis)); };
  return {at(0), at(1), at(2)};
}

/// Calls `visit(i, cell_of, octant)` for the points of a scan (m, sensor frame), one after another.
/// `cell_of()`: the cell of the point; `octant`: its voxel there, see octant_of(). The rounding of
/// a float moves borders of cells by less than 0.1 mm.
template <class Visitor>
void for_each_in_cells(PointsView points, const Pose& T_world_sensor, Visitor&& visit) {
  constexpr std::size_t kBatch = 256;
  alignas(64) std::int32_t voxels[3][kBatch];
  const VoxelKey origin = cell_at(T_world_sensor.translation());
  Pose T_origin_sensor = T_world_sensor;
  T_origin_sensor.translation() -= corner_of(origin);
  const detail::PackTransform to_voxels(T_origin_sensor, 2.0 / kWorldCell);
  for (std::size_t begin = 0; begin < points.size(); begin += kBatch) {
    const PointsView batch = points.subview(begin, std::min(kBatch, points.size() - begin));
    detail::for_packs(batch.size(), [&](auto at) {
      const auto x = at.load(batch.x.data());
      const auto y = at.load(batch.y.data());
      const auto z = at.load(batch.z.data());
      for (std::size_t axis = 0; axis < 3; ++axis) {
        floor(to_voxels(axis, x, y, z)).store(&voxels[axis][at.begin]);
      }
    });
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const std::int32_t x = voxels[0][i], y = voxels[1][i], z = voxels[2][i];
      const auto cell_of = [&] { return origin + voxel_key_step(x >> 1, y >> 1, z >> 1); };
      visit(begin + i, cell_of, static_cast<unsigned>((x & 1) | (y & 1) << 1 | (z & 1) << 2));
    }
  }
}

/// Point i (m, sensor frame) of a scan, m, world frame.
inline Eigen::Vector3d world_point(PointsView points, std::size_t i, const Pose& T_world_sensor) {
  return T_world_sensor * Eigen::Vector3d(static_cast<double>(points.x[i]),
                                          static_cast<double>(points.y[i]),
                                          static_cast<double>(points.z[i]));
}

}  // namespace dynains
