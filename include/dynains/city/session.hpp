// A session of a map of many days: its grid, its points, and what is known of it.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "dynains/evidence/free_space_config.hpp"
#include "dynains/evidence/range_image.hpp"
#include "dynains/parameters.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/world_cells.hpp"
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

/// One static point of a session, as files hold it.
struct SessionPoint {
  float x, y;               ///< m, relative to the corner of its tile with the lowest x and y
  float z;                  ///< m, world frame
  std::uint32_t scan;       ///< number of the scan that measured it
  std::uint32_t label;      ///< of the recording, 0 without labels
  std::uint32_t is_ground;  ///< by its verdict, 0 or 1
};

/// m, world frame.
inline Eigen::Vector3d tile_corner(const SessionGrid& grid, const TileIndex& tile) {
  return {grid.tile * static_cast<double>(tile[0]), grid.tile * static_cast<double>(tile[1]), 0.0};
}

/// The tile of a position (m, world frame).
inline TileIndex tile_index(const SessionGrid& grid, const Eigen::Vector3d& position) {
  return {static_cast<std::int64_t>(std::floor(position.x() / grid.tile)),
          static_cast<std::int64_t>(std::floor(position.y() / grid.tile))};
}

/// World position of a point of a tile, m.
inline Eigen::Vector3d position_of(const SessionGrid& grid, const TileIndex& tile,
                                   const SessionPoint& point) {
  return tile_corner(grid, tile) + Eigen::Vector3f(point.x, point.y, point.z).cast<double>();
}

/// Voxel of a point in its tile.
inline VoxelKey session_voxel(const SessionGrid& grid, const SessionPoint& point) {
  const auto index = [&](float metres) {
    return static_cast<std::int64_t>(std::floor(static_cast<double>(metres) / grid.map_voxel));
  };
  return voxel_key(index(point.x), index(point.y), index(point.z));
}

/// Where a session lies in the frame of a map: result of SessionAligner.
struct SessionAlignment {
  /// The poses of the session are multiplied by it, from the left.
  Pose T_city_session = Pose::Identity();
  /// The estimate that was refined.
  Pose T_city_start = Pose::Identity();
  double residual = 0.0;     ///< m, root mean square distance of the points that fit to the map
  double fitting = 0.0;      ///< [0, 1], share of the points at upright surfaces that fit
  double uncertainty = 0.0;  ///< m, of the translation along its least certain direction
  std::vector<std::string> sessions;  ///< of the map whose points it was aligned to, sorted
};

/// A part of the file of a session.
struct SessionBlock {
  std::uint64_t offset = 0, size = 0;  ///< bytes, without the checksum behind it
};

/// A reference scan of a session.
struct SessionReference {
  std::uint32_t scan = 0;
  Eigen::Vector3d sensor = Eigen::Vector3d::Zero();  ///< m, world frame
  SessionBlock block;
};

/// A session of the map: all but its points and the images of its references.
struct SessionInfo {
  std::string name;         ///< of its file: letters, digits, '.', '_', '-'; first no '.', '-'
  double begin = 0.0;       ///< s; sessions are ordered by begin, then by name
  std::string recording;    ///< as the user named it
  std::string fingerprint;  ///< of poses and times; empty: unknown
  std::string config;       ///< JSON of the configuration that gave the verdicts; may be empty
  /// How its poses were moved into the frame of the map; empty: they were taken as they are.
  std::optional<SessionAlignment> alignment;
  /// The margins of its verdicts, which hold for its references, too.
  FreeSpaceConfig evidence;

  // The rest is found by SessionWriter.
  SessionGrid grid;
  std::uint64_t scans = 0;
  std::uint64_t points = 0;                           ///< static points, one per voxel
  Eigen::Vector3d lowest = Eigen::Vector3d::Zero();   ///< m, world frame, of its points
  Eigen::Vector3d highest = Eigen::Vector3d::Zero();  ///< m, world frame, of its points
  std::map<TileIndex, SessionBlock> tiles;
  RangeImageGrid image_grid;  ///< of all references
  std::vector<SessionReference> references;
};

/// Whether `name` can name a session.
bool is_session_name(const std::string& name);

}  // namespace dynains
