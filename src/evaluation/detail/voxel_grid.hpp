// Voxel keys of a world-aligned grid.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "dynains/errors.hpp"
#include "dynains/stage/voxel_hash_table.hpp"

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
      if (!(std::abs(cell) < 0x1p52)) {
        throw PoseError("the first pose lies too far from the world's origin for a grid of " +
                        std::to_string(edge) + " m");
      }
      anchor_[static_cast<std::size_t>(axis)] = static_cast<std::int64_t>(cell);
    }
  }

  double edge() const { return edge_; }

  /// kNoKey for a point that is not finite or that lies 2^20 cells or more from the anchor along
  /// some axis (210 km at 0.2 m).
  VoxelKey key(const Eigen::Vector3d& p_world) const {
    return key(p_world.x(), p_world.y(), p_world.z());
  }
  VoxelKey key(double x, double y, double z) const {
    bool is_inside = true;
    const auto number = [&](double coordinate, std::int64_t anchor) {
      const double quotient = coordinate / edge_;
      const bool is_exact = std::abs(quotient) < 0x1p53;
      const double cell = is_exact ? quotient : 0.0;
      // floor() without a call into libm, which the baseline instruction set would need.
      auto result = static_cast<std::int64_t>(cell);
      result -= static_cast<double>(result) > cell ? 1 : 0;
      result -= anchor;
      // One cell at either end is kept free for the neighbours.
      is_inside &= is_exact && result >= 1 - kVoxelKeyOffset && result <= kVoxelKeyOffset - 2;
      return result;
    };
    const std::int64_t i = number(x, anchor_[0]);
    const std::int64_t j = number(y, anchor_[1]);
    const std::int64_t k = number(z, anchor_[2]);
    return is_inside ? voxel_key(i, j, k) : kNoKey;
  }

  /// Lower corner of a voxel.
  Eigen::Vector3d corner(VoxelKey key) const {
    Eigen::Vector3d corner;
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t number = voxel_index(key, axis) + anchor_[static_cast<std::size_t>(axis)];
      corner[axis] = static_cast<double>(number) * edge_;
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
  std::array<std::int64_t, 3> anchor_{};  // cell numbers
};

/// Offsets from a key to itself (first) and to its 26 neighbours.
inline constexpr std::array<VoxelKey, 27> neighbour_offsets() {
  std::array<VoxelKey, 27> offsets{};
  std::size_t next = 1;
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        if (x == 0 && y == 0 && z == 0) continue;
        offsets[next++] = voxel_key_step(x, y, z);
      }
    }
  }
  return offsets;
}
inline constexpr std::array<VoxelKey, 27> kNeighbours = neighbour_offsets();

using VoxelIndex = VoxelHashTable<>;

}  // namespace dynains::evaluation::detail
