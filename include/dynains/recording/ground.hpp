// Height of the ground of a recording.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/paged_tiles.hpp"
#include "dynains/recording/world_cells.hpp"

namespace dynains {

/// Mean height of the ground in columns of cells, from all scans of a recording: single scans have
/// noise and hidden ground, the recording has neither.
class RecordingGround {
 public:
  /// `budget`: bytes in memory, if the cells around the sensor take less; the others wait in the
  /// store, which outlives this, and what it throws comes out of all functions.
  RecordingGround(ByteStore& store, std::size_t budget) : tiles_(store, budget) {}

  /// Adds the ground points of a scan (m, sensor frame).
  void add(PointsView points, Span<const PointLabel> verdicts, const Pose& T_world_sensor) {
    Column* sum = nullptr;
    CellOfPoint column;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (verdicts[i] != PointLabel::kGround) continue;
      const Eigen::Vector3d point = world_point(points, i, T_world_sensor);
      if (column.go_to({point.x(), point.y(), 0.0})) {
        Tile& tile = tiles_.at(tile_of(column.cell()));
        sum = &tile.values[tile.add(column.cell())];
      }
      sum->mean += (point.z() - sum->mean) / static_cast<double>(++sum->count);
    }
    free_far(T_world_sensor.translation());
  }

  /// Keeps to the budget, while points around a sensor (m, world frame) are asked for.
  void free_far(const Eigen::Vector3d& sensor) { tiles_.free_far(sensor, kLookRange); }

  /// Puts all columns into the store.
  void rest() { tiles_.rest(); }

  /// Height of a point (m, world frame) above the ground, m, if there is ground in its column.
  std::optional<double> rise(const Eigen::Vector3d& point) {
    const Column* const ground = find(column_at(point));
    if (ground == nullptr) return std::nullopt;
    return point.z() - ground->mean;
  }

  /// Whether no ground within 0.8 m of the column of a point is 0.2 m lower than its own.
  bool is_level(const Eigen::Vector3d& point) {
    constexpr int kReach = 2;      // columns
    constexpr double kStep = 0.2;  // m
    const VoxelKey column = column_at(point);
    const Column* const own = find(column);
    if (own == nullptr) return false;
    const double lowest = own->mean - kStep;
    for (int x = -kReach; x <= kReach; ++x) {
      for (int y = -kReach; y <= kReach; ++y) {
        const Column* const beside = find(column + voxel_key_step(x, y, 0));
        if (beside != nullptr && beside->mean < lowest) return false;
      }
    }
    return true;
  }

 private:
  struct Column {
    double mean = 0.0;  // m
    std::uint32_t count = 0;
  };
  using Tile = VoxelTile<Column>;

  static VoxelKey column_at(const Eigen::Vector3d& point) {
    return cell_at({point.x(), point.y(), 0.0});
  }
  // Null: there are too few ground points.
  const Column* find(VoxelKey column) {
    constexpr std::uint32_t kFewest = 20;
    const Tile* const tile = tiles_.find(tile_of(column));
    const Column* const found = tile == nullptr ? nullptr : tile->find(column);
    return found == nullptr || found->count < kFewest ? nullptr : found;
  }

  PagedTiles<Tile> tiles_;
};

}  // namespace dynains
