// Static points of one session, by tile: its contribution to a map of many sessions.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>

#include "dynains/city/session.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/byte_store.hpp"
#include "dynains/recording/paged_tiles.hpp"
#include "dynains/recording/world_cells.hpp"

namespace dynains {

/// Collects the static points of the scans of one session. The first point of each voxel is kept.
/// Tiles far from the sensor are moved to a store. All functions throw IoError if it fails.
class SessionPoints {
 public:
  /// `range`: m; farther points are not contributed. `store` outlives this. Throws ConfigError.
  SessionPoints(const SessionGrid& grid, double range, ByteStore& store)
      : grid_((grid.validate(), grid)), range_(range), tiles_(store, kBudget, grid.tile) {}

  /// Adds the static points of one scan (m, sensor frame). `verdicts`: final verdict by point.
  /// `labels`: label of the recording by point, or empty. `scan`: its number; ascending.
  void add(PointsView points, Span<const PointLabel> verdicts, Span<const std::uint32_t> labels,
           const Pose& T_world_sensor, std::uint32_t scan) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!is_static(verdicts[i])) continue;
      const float squared =
          points.x[i] * points.x[i] + points.y[i] * points.y[i] + points.z[i] * points.z[i];
      if (static_cast<double>(squared) > range_ * range_) continue;
      const Eigen::Vector3d position = world_point(points, i, T_world_sensor);
      const TileIndex index = tile_index(grid_, position);
      const Eigen::Vector3f p = (position - tile_corner(grid_, index)).cast<float>();
      const std::uint32_t label = labels.empty() ? 0 : labels[i];
      const std::uint32_t is_ground = verdicts[i] == PointLabel::kGround ? 1 : 0;
      const SessionPoint point = {p.x(), p.y(), p.z(), scan, label, is_ground};
      VoxelTile<SessionPoint>& tile = tiles_.at(index);
      const std::size_t count = tile.size();
      const std::uint32_t number = tile.add(session_voxel(grid_, point));
      if (number == count) tile.values[number] = point;
    }
    tiles_.free_far(T_world_sensor.translation(), range_);
  }

  /// Number of points.
  std::size_t size() const { return tiles_.size(); }

  /// Calls `visit(TileIndex, const std::vector<SessionPoint>&)` in the order of the indices.
  template <class Visitor>
  void for_each_tile(Visitor&& visit) {
    tiles_.for_each_index([&](const TileIndex& index) {
      visit(index, tiles_.find(index)->values);
      tiles_.free_far(tiles_.middle(index), 0.0);
    });
  }

 private:
  static constexpr std::size_t kBudget = std::size_t{64} << 20U;  // bytes

  SessionGrid grid_;
  double range_;  // m
  PagedTiles<VoxelTile<SessionPoint>> tiles_;
};

}  // namespace dynains
