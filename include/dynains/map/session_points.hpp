// Static points of one session, by tile: its contribution to a map of many sessions.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/stage/voxel_hash_table.hpp"

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

struct SessionPointsConfig {
  double contribution_range = 60.0;  ///< m

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(Parameter{"contribution_range", self.contribution_range, closed(5, 300), "m",
                      "points at a larger distance from the sensor are not contributed"});
  }

  /// Throws ConfigError.
  void validate() const { validate_parameters("SessionPoints", *this); }
};

/// Collects the static points of the scans of one session. The first point of each voxel is kept.
/// The result depends on the scans of this session only. Memory: 24 bytes per kept point, with
/// the margin of a growing vector, and up to 48 for each block of 8 x 4 x 2 voxels.
class SessionPoints {
 public:
  /// Throws ConfigError.
  explicit SessionPoints(const SessionGrid& grid, const SessionPointsConfig& config = {})
      : grid_((grid.validate(), grid)), config_((config.validate(), config)) {}

  const SessionGrid& grid() const { return grid_; }

  /// Adds the static points of one scan (m, sensor frame). `verdicts`: final verdict by point.
  /// `labels`: label of the recording by point, or empty. `scan`: its number; ascending.
  void add(PointsView points, Span<const PointLabel> verdicts, Span<const std::uint32_t> labels,
           const Eigen::Isometry3d& T_world_sensor, std::uint32_t scan) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!is_static(verdicts[i])) continue;
      const Eigen::Vector3d local(static_cast<double>(points.x[i]),
                                  static_cast<double>(points.y[i]),
                                  static_cast<double>(points.z[i]));
      if (local.squaredNorm() > config_.contribution_range * config_.contribution_range) continue;
      add_point(T_world_sensor * local, {0.0F, 0.0F, 0.0F, scan, labels.empty() ? 0 : labels[i],
                                         verdicts[i] == PointLabel::kGround});
    }
  }

  std::size_t size() const { return size_; }

  /// Calls `visit(TileIndex, const std::vector<SessionPoint>&)` in the order of the indices.
  template <class Visitor>
  void for_each_tile(Visitor&& visit) const {
    for (const auto& [index, tile] : tiles_) visit(index, tile.points);
  }

 private:
  // Blocks of 8 x 4 x 2 voxels: neighbouring points of a scan mostly lie in one.
  struct Tile {
    std::vector<SessionPoint> points;
    VoxelHashTable<> blocks;
    std::vector<std::uint64_t> filled;  // by block: a bit for each voxel with a point
    VoxelKey newest_key = {};           // of the block of the newest point
    std::uint32_t newest_block = 0;

    // False if the voxel has a point already.
    bool fill(const std::array<std::int64_t, 3>& voxel) {
      const VoxelKey key = voxel_key(voxel[0] >> 3, voxel[1] >> 2, voxel[2] >> 1);
      if (filled.empty() || key != newest_key) {
        newest_key = key;
        newest_block = blocks.insert(key);
        if (newest_block == filled.size()) filled.push_back(0);
      }
      const std::int64_t place = (voxel[0] & 7) | (voxel[1] & 3) << 3 | (voxel[2] & 1) << 5;
      const std::uint64_t bit = std::uint64_t{1} << static_cast<std::uint64_t>(place);
      const bool is_new = (filled[newest_block] & bit) == 0;
      filled[newest_block] |= bit;
      return is_new;
    }
  };

  // `point`: all but the coordinates.
  void add_point(const Eigen::Vector3d& position, SessionPoint point) {
    const TileIndex index = {static_cast<std::int32_t>(std::floor(position.x() / grid_.tile)),
                             static_cast<std::int32_t>(std::floor(position.y() / grid_.tile))};
    if (newest_ == nullptr || index != newest_index_) {
      newest_ = &tiles_[index];
      newest_index_ = index;
    }
    const Eigen::Vector3d relative = position - tile_corner(grid_, index);
    point.x = static_cast<float>(relative.x());
    point.y = static_cast<float>(relative.y());
    point.z = static_cast<float>(relative.z());
    if (!newest_->fill(session_voxel_index(grid_, point))) return;
    newest_->points.push_back(point);
    ++size_;
  }

  SessionGrid grid_;
  SessionPointsConfig config_;
  std::map<TileIndex, Tile> tiles_;
  Tile* newest_ = nullptr;  // elements of a map do not move
  TileIndex newest_index_ = {};
  std::size_t size_ = 0;
};

}  // namespace dynains
