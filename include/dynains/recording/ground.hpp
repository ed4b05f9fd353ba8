// Height of the ground of a recording.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/paged_tiles.hpp"
#include "dynains/recording/world_point.hpp"

namespace dynains {

/// Mean height of the ground in cells of 0.4 m, from all scans of a recording: single scans have
/// noise and hidden ground, the recording has neither.
class RecordingGround {
 public:
  /// `budget`: bytes in memory, if the cells around the sensor take less; the others wait in the
  /// store, which outlives this, and what it throws comes out of all functions.
  RecordingGround(ByteStore& store, std::size_t budget)
      : tiles_(store, kCell * (1 << kShift), budget) {}

  /// Adds the ground points of a scan (m, sensor frame).
  void add(PointsView points, Span<const PointLabel> verdicts, const Pose& T_world_sensor) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (verdicts[i] != PointLabel::kGround) continue;
      const Eigen::Vector3d at = world_point(points, i, T_world_sensor);
      const Index index = index_of(at);
      Cell& cell = tiles_.at(tile_of(index)).cells[cell_of(index)];
      if (cell.count++ == 0) cell.origin = at.z();
      cell.mean +=
          (static_cast<float>(at.z() - cell.origin) - cell.mean) / static_cast<float>(cell.count);
    }
    free_far(T_world_sensor.translation());
  }

  /// Keeps to the budget, while cells around a sensor (m, world frame) are asked for.
  void free_far(const Eigen::Vector3d& sensor) {
    constexpr double kNear = 60.0;  // m
    tiles_.free_far(sensor, kNear);
  }

  /// Height of a point (m, world frame) above the ground in its cell. Empty where the recording has
  /// less than 20 points of the ground.
  std::optional<double> rise(const Eigen::Vector3d& point) {
    const std::optional<double> height = height_of(index_of(point));
    if (!height) return std::nullopt;
    return point.z() - *height;
  }

  /// Whether the ground in the cell of a point (m, world frame) is not a step above that of any
  /// cell around: the underside of a vehicle can look like ground.
  bool is_level(const Eigen::Vector3d& point) {
    constexpr std::int64_t kReach = 2;  // cells
    constexpr double kStep = 0.2;       // m
    const Index index = index_of(point);
    const std::optional<double> height = height_of(index);
    if (!height) return false;
    for (std::int64_t dx = -kReach; dx <= kReach; ++dx) {
      for (std::int64_t dy = -kReach; dy <= kReach; ++dy) {
        const std::optional<double> other = height_of({index[0] + dx, index[1] + dy});
        if (other && *height > *other + kStep) return false;
      }
    }
    return true;
  }

 private:
  static constexpr double kCell = 0.4;  // m
  static constexpr int kShift = 6;      // cells of a tile: 64 x 64
  static constexpr std::uint32_t kFewest = 20;

  using Index = std::array<std::int64_t, 2>;
  struct Cell {
    double origin = 0.0;  // m, the first height
    float mean = 0.0F;    // m, above it
    std::uint32_t count = 0;
  };
  struct Tile {
    std::vector<Cell> cells = std::vector<Cell>(std::size_t{1} << (2 * kShift));

    std::size_t size() const { return cells.size(); }
    std::size_t memory_bytes() const { return cells.size() * sizeof(Cell); }
    void pack(std::vector<std::uint8_t>& bytes) const {
      bytes.resize(memory_bytes());
      std::memcpy(bytes.data(), cells.data(), bytes.size());
    }
    void unpack(const std::vector<std::uint8_t>& bytes) {
      cells.resize(bytes.size() / sizeof(Cell));
      std::memcpy(cells.data(), bytes.data(), bytes.size());
    }
  };

  static Index index_of(const Eigen::Vector3d& at) {
    return {static_cast<std::int64_t>(std::floor(at.x() / kCell)),
            static_cast<std::int64_t>(std::floor(at.y() / kCell))};
  }
  static GroundTile tile_of(const Index& index) { return {index[0] >> kShift, index[1] >> kShift}; }
  // Index of a cell in its tile.
  static std::size_t cell_of(const Index& index) {
    constexpr std::int64_t kMask = (std::int64_t{1} << kShift) - 1;
    return static_cast<std::size_t>((index[0] & kMask) << kShift | (index[1] & kMask));
  }
  // Mean height of the ground in a cell with enough points, m.
  std::optional<double> height_of(const Index& index) {
    const Tile* const tile = tiles_.find(tile_of(index));
    if (tile == nullptr) return std::nullopt;
    const Cell& cell = tile->cells[cell_of(index)];
    if (cell.count < kFewest) return std::nullopt;
    return cell.origin + static_cast<double>(cell.mean);
  }

  PagedTiles<Tile> tiles_;
};

}  // namespace dynains
