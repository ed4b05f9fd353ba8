// Voxel keys of a world-aligned grid.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
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
      anchor_[static_cast<std::size_t>(axis)] = cell;
    }
  }

  double edge() const { return edge_; }

  /// kNoKey for a point that is not finite or that lies 2^20 cells or more from the anchor along
  /// some axis (210 km at 0.2 m).
  VoxelKey key(const Eigen::Vector3d& p_world) const {
    return key(p_world.x(), p_world.y(), p_world.z());
  }
  /// Without branches and without conversions between numbers, so that loops can use vectors.
  VoxelKey key(double x, double y, double z) const {
    const VoxelKey i = cell(x, anchor_[0]), j = cell(y, anchor_[1]), k = cell(z, anchor_[2]);
    // One cell at either end is kept free for the neighbours.
    const VoxelKey beyond = (i - 1) | (i + 1) | (j - 1) | (j + 1) | (k - 1) | (k + 1);
    const VoxelKey outside = beyond >> kVoxelKeyBits == 0 ? 0 : kNoKey;
    return outside | i << (2 * kVoxelKeyBits) | j << kVoxelKeyBits | k;
  }

  /// Lower corner of a voxel.
  Eigen::Vector3d corner(VoxelKey key) const {
    Eigen::Vector3d corner;
    for (int axis = 0; axis < 3; ++axis) {
      const auto number = static_cast<double>(voxel_index(key, axis));
      corner[axis] = (number + anchor_[static_cast<std::size_t>(axis)]) * edge_;
    }
    return corner;
  }

  /// Squared distance from a point to the cube of a voxel, m^2.
  double squared_distance(const Eigen::Vector3d& p_world, VoxelKey key) const {
    const Eigen::Vector3d local = p_world - corner(key);
    return (local - local.cwiseMax(0.0).cwiseMin(edge_)).squaredNorm();
  }

 private:
  /// Number of the cell of a coordinate, from 0; at least 2^kVoxelKeyBits if it is outside.
  VoxelKey cell(double coordinate, double anchor) const {
    // Doubles in [2^52, 2^53) are integers, which their lowest bits are.
    constexpr double kIntegers = 0x1.8p52;
    constexpr VoxelKey kIntegerBits = VoxelKey{0x433} << 52U | VoxelKey{1} << 51U;
    const double number = coordinate / edge_;
    const double nearest = (number + kIntegers) - kIntegers;
    const VoxelKey is_above = bits(number - nearest + 0.0) >> 63U;  // 0.0: not the sign of -0
    return bits(nearest - anchor + (kIntegers + static_cast<double>(kVoxelKeyOffset))) -
           kIntegerBits - is_above;
  }
  static VoxelKey bits(double number) {
    VoxelKey bits = 0;
    std::memcpy(&bits, &number, sizeof(bits));
    return bits;
  }

  double edge_;
  std::array<double, 3> anchor_{};  // cell numbers
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

}  // namespace dynains::evaluation::detail
