// Grid of a map of many sessions: tiles, voxels, and the points in them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>

#include "dynains/parameters.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// Grid of a map of many sessions. All its sessions have the same grid.
struct SessionGrid {
  double map_voxel = 0.2;  ///< m, edge of a voxel, which holds one point
  double tile = 50.0;      ///< m, edge of a tile

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(Parameter{"map_voxel", self.map_voxel, closed(0.02, 5), "m",
                      "resolution of the map of many sessions"});
    visitor(Parameter{"tile", self.tile, closed(10, 500), "m",
                      "edge of the tiles of the map of many sessions"});
  }

  /// Throws ConfigError.
  void validate() const { validate_parameters("SessionGrid", *this); }
};

/// Indices of a tile along x and y of the world. A tile is not bounded in z.
using TileIndex = std::array<std::int32_t, 2>;

/// One static point of a session.
struct SessionPoint {
  float x, y;           ///< m, relative to the corner of its tile with the lowest x and y
  float z;              ///< m, world frame
  std::uint32_t scan;   ///< number of the scan that measured it
  std::uint32_t label;  ///< of the recording, 0 without labels
  bool is_ground;       ///< by its verdict
};

inline Eigen::Vector3d tile_corner(const SessionGrid& grid, const TileIndex& tile) {
  return {grid.tile * tile[0], grid.tile * tile[1], 0.0};
}

/// The tile of a position (m, world frame).
inline TileIndex tile_index(const SessionGrid& grid, const Eigen::Vector3d& position) {
  return {static_cast<std::int32_t>(std::floor(position.x() / grid.tile)),
          static_cast<std::int32_t>(std::floor(position.y() / grid.tile))};
}

/// Indices of the voxel of a point in its tile.
inline std::array<std::int64_t, 3> session_voxel_index(const SessionGrid& grid,
                                                       const SessionPoint& point) {
  const auto index = [&](float metres) {
    return static_cast<std::int64_t>(std::floor(static_cast<double>(metres) / grid.map_voxel));
  };
  return {index(point.x), index(point.y), index(point.z)};
}

/// Voxel of a point in its tile.
inline VoxelKey session_voxel(const SessionGrid& grid, const SessionPoint& point) {
  const std::array<std::int64_t, 3> index = session_voxel_index(grid, point);
  return voxel_key(index[0], index[1], index[2]);
}

}  // namespace dynains
