// Cells of the world with points of a scan.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// Index of a square tile, along x and y of the world.
using TileIndex = std::array<std::int64_t, 2>;

inline constexpr double kWorldCell = 0.4;  ///< m, a cube
inline constexpr int kTileShift = 6;       ///< a tile has 64 x 64 columns
inline constexpr double kTileEdge = kWorldCell * static_cast<double>(1 << kTileShift);  ///< m

inline constexpr double kLookRange = 60.0;  ///< m, horizontal, from the sensor to what it tests

/// The tile of a cell.
inline TileIndex tile_of(VoxelKey cell) {
  return {voxel_index(cell, 0) >> kTileShift, voxel_index(cell, 1) >> kTileShift};
}

/// The cell of a point, m, world frame.
inline VoxelKey cell_at(const Eigen::Vector3d& point) { return voxel_at(point, kWorldCell); }

/// The corner of a cell with the lowest coordinates, m. `edge`: m, of the cells.
inline Eigen::Vector3d corner_of(VoxelKey cell, double edge = kWorldCell) {
  const auto at = [&](int axis) { return edge * static_cast<double>(voxel_index(cell, axis)); };
  return {at(0), at(1), at(2)};
}

/// The cell of one point after another: most lie in the cell of the point before.
class CellOfPoint {
 public:
  /// Goes to the cell of a point (m, world frame). Returns whether it is another one.
  bool go_to(const Eigen::Vector3d& point) {
    if (locate(point)) return false;
    cell_ = cell_at(point);
    corner_ = corner_of(cell_);
    locate(point);
    return true;
  }
  VoxelKey cell() const { return cell_; }
  /// Place of the point in the cell, about [0, 1] along each axis.
  const Eigen::Array3d& within() const { return within_; }

 private:
  // Sets the place of a point. Returns whether it lies in the cell.
  bool locate(const Eigen::Vector3d& point) {
    within_ = (point - corner_).array() / kWorldCell;
    return within_.minCoeff() >= 0.0 && within_.maxCoeff() < 1.0;
  }

  VoxelKey cell_ = 0;
  // m; no point lies in the first cell.
  Eigen::Vector3d corner_ = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Array3d within_ = Eigen::Array3d::Zero();
};

/// Point i (m, sensor frame) of a scan, m, world frame.
inline Eigen::Vector3d world_point(PointsView points, std::size_t i, const Pose& T_world_sensor) {
  return T_world_sensor * Eigen::Vector3d(static_cast<double>(points.x[i]),
                                          static_cast<double>(points.y[i]),
                                          static_cast<double>(points.z[i]));
}

}  // namespace dynains
