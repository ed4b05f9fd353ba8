// Voxel keys of a world-aligned grid.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <string>

#include "dynains/errors.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::evaluation::detail {

/// Key of points outside of the grid.
inline constexpr VoxelKey kNoKey = ~VoxelKey{0};

/// Cells [i * edge, (i + 1) * edge) per axis of the world frame. Keys count from the cell of an
/// anchor point, so that large coordinates (UTM) fit; the grid itself does not move with it.
class VoxelGrid {
 public:
  /// Throws PoseError if the cell number of the anchor cannot be exact.
  VoxelGrid(double edge, const Eigen::Vector3d& anchor) : edge_(edge) {
    for (int axis = 0; axis < 3; ++axis) {
      const double cell = std::floor(anchor[axis] / edge);
      if (!(std::abs(cell) < 0x1p50)) {
        throw PoseError("the first pose lies too far from the world's origin for a grid of " +
                        std::to_string(edge) + " m");
      }
      anchor_[axis] = cell;
    }
  }

  double edge() const { return edge_; }

  /// kNoKey for a point that is not finite or that lies 2^20 cells or more from the anchor along
  /// some axis (210 km at 0.2 m). One cell at either end is kept free for the neighbours.
  VoxelKey key(const Eigen::Vector3d& p_world) const {
    const Eigen::Array3d cell = (p_world / edge_).array().floor() - anchor_;
    constexpr auto kEnd = static_cast<double>(kVoxelKeyOffset - 1);
    if (!(cell >= -kEnd && cell < kEnd).all()) return kNoKey;
    const auto index = [&](Eigen::Index axis) { return static_cast<std::int64_t>(cell[axis]); };
    return voxel_key(index(0), index(1), index(2));
  }

  /// Lower corner of a voxel.
  Eigen::Vector3d corner(VoxelKey key) const {
    Eigen::Vector3d corner;
    for (int axis = 0; axis < 3; ++axis) {
      const auto number = static_cast<double>(voxel_index(key, axis));
      corner[axis] = (number + anchor_[axis]) * edge_;
    }
    return corner;
  }

  /// Squared distance from a point to the cube of a voxel, m^2.
  double squared_distance(const Eigen::Vector3d& p_world, VoxelKey key) const {
    const Eigen::Vector3d local = p_world - corner(key);
    return (local - local.cwiseMax(0.0).cwiseMin(edge_)).squaredNorm();
  }

 private:
  double edge_;
  Eigen::Array3d anchor_;  // cell numbers
};

}  // namespace dynains::evaluation::detail
