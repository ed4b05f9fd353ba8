// Height of the ground of a recording.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/paged_tiles.hpp"
#include "dynains/recording/world_cells.hpp"

namespace dynains {

/// Mean height of the ground in cells of 0.4 m, from all scans of a recording: single scans have
/// noise and hidden ground, the recording has neither.
class RecordingGround {
 public:
  /// `budget`: bytes in memory, if the cells around the sensor take less; the others wait in the
  /// store, which outlives this, and what it throws comes out of all functions.
  RecordingGround(ByteStore& store, std::size_t budget) : tiles_(store, budget) {}

  /// Adds the ground points of a scan (m, sensor frame).
  void add(PointsView points, Span<const PointLabel> verdicts, const Pose& T_world_sensor) {
    const auto is_ground = [&](std::size_t i) { return verdicts[i] == PointLabel::kGround; };
    for_each_located(points, T_world_sensor, is_ground, [&](const LocatedPoints& located) {
      const Span<const LocatedPoints::Run> runs = located.runs();
      std::array<Tile*, LocatedPoints::kMost> tiles;
      std::array<Cell*, LocatedPoints::kMost> cells;
      for (std::size_t r = 0; r < runs.size(); ++r) {
        tiles[r] = &tiles_.at(tile_of(runs[r].cell));
        cells[r] = &tiles[r]->cells[number_of(runs[r].cell)];
        __builtin_prefetch(cells[r], 1);
      }
      for (std::size_t r = 0; r < runs.size(); ++r) {
        for (std::size_t k = runs[r].begin; k < runs[r].end; ++k) {
          cells[r]->add(tiles[r]->from_origin(located.at(k).z()));
        }
      }
    });
    free_far(T_world_sensor.translation());
  }

  /// Finds the lowest ground around all cells, after all scans.
  void complete() {
    tiles_.for_each_index([&](const GroundTile& index) {
      Tile& tile = tiles_.at(index);
      for (std::size_t i = 0; i < tile.cells.size(); ++i) {
        if (tile.cells[i].count == 0) continue;
        tile.cells[i].lowest = static_cast<float>(lowest_around(index, i) - tile.origin);
      }
      tiles_.free_far(tiles_.middle(index), 0.0);
    });
  }

  /// Keeps to the budget, while cells around a sensor (m, world frame) are asked for.
  void free_far(const Eigen::Vector3d& sensor) {
    constexpr double kNear = 60.0;  // m
    tiles_.free_far(sensor, kNear);
  }

  /// Puts all cells into the store.
  void rest() { tiles_.rest(); }

  /// Calls `visit(i, cell, rise, is_level)` for the points (m, sensor frame) of which `is_taken(i)`
  /// in cells with ground. `rise`: m, above the ground of the cell. `is_level`: whether no ground
  /// within 0.8 m is 0.2 m lower. After complete().
  template <class IsTaken, class Visitor>
  void for_each_rise(PointsView points, const Pose& T_world_sensor, IsTaken&& is_taken,
                     Visitor&& visit) {
    for_each_located(points, T_world_sensor, is_taken, [&](const LocatedPoints& located) {
      const Span<const LocatedPoints::Run> runs = located.runs();
      std::array<const Tile*, LocatedPoints::kMost> tiles;
      std::array<const Cell*, LocatedPoints::kMost> cells;
      for (std::size_t r = 0; r < runs.size(); ++r) {
        tiles[r] = tiles_.find(tile_of(runs[r].cell));
        cells[r] = tiles[r] == nullptr ? nullptr : &tiles[r]->cells[number_of(runs[r].cell)];
        __builtin_prefetch(cells[r]);
      }
      for (std::size_t r = 0; r < runs.size(); ++r) {
        if (cells[r] == nullptr || !cells[r]->has_ground()) continue;
        for (std::size_t k = runs[r].begin; k < runs[r].end; ++k) {
          const double z = located.at(k).z() - tiles[r]->origin;
          visit(located.point(k), runs[r].cell, z - static_cast<double>(cells[r]->mean),
                cells[r]->is_level());
        }
      }
    });
  }

 private:
  struct Cell {
    float mean = 0.0F;                                      // m, above the origin of the tile
    float lowest = std::numeric_limits<float>::infinity();  // m, the same, of the ground around
    std::uint32_t count = 0;

    void add(float z) { mean += (z - mean) / static_cast<float>(++count); }
    bool has_ground() const {
      constexpr std::uint32_t kFewest = 20;
      return count >= kFewest;
    }
    bool is_level() const {
      constexpr float kStep = 0.2F;  // m
      return has_ground() && mean - lowest <= kStep;
    }
  };
  struct Tile {
    double origin = std::numeric_limits<double>::quiet_NaN();  // m, the first height
    std::vector<Cell> cells = std::vector<Cell>(kTileCells * kTileCells);

    float from_origin(double z) {
      if (std::isnan(origin)) origin = z;
      return static_cast<float>(z - origin);
    }
    std::size_t size() const { return cells.size(); }
    std::size_t memory_bytes() const { return cells.size() * sizeof(Cell); }
    void pack(std::vector<std::uint8_t>& bytes) const {
      bytes.resize(sizeof(origin) + memory_bytes());
      std::memcpy(bytes.data(), &origin, sizeof(origin));
      std::memcpy(bytes.data() + sizeof(origin), cells.data(), memory_bytes());
    }
    void unpack(const std::vector<std::uint8_t>& bytes) {
      std::memcpy(&origin, bytes.data(), sizeof(origin));
      std::memcpy(cells.data(), bytes.data() + sizeof(origin), memory_bytes());
    }
  };

  static std::size_t number_of(const WorldCell& cell) {
    return static_cast<std::size_t>((cell[0] & (kTileCells - 1)) << kTileShift |
                                    (cell[1] & (kTileCells - 1)));
  }

  // m, world frame; infinity: there is no ground.
  double lowest_around(const GroundTile& index, std::size_t number) {
    constexpr std::int64_t kReach = 2;  // cells
    const auto x = index[0] * kTileCells + static_cast<std::int64_t>(number >> kTileShift);
    const auto y = index[1] * kTileCells + static_cast<std::int64_t>(number % kTileCells);
    double lowest = std::numeric_limits<double>::infinity();
    for (std::int64_t dx = -kReach; dx <= kReach; ++dx) {
      for (std::int64_t dy = -kReach; dy <= kReach; ++dy) {
        const WorldCell beside = {x + dx, y + dy, 0};
        const Tile* const tile = tiles_.find(tile_of(beside));
        if (tile == nullptr) continue;
        const Cell& cell = tile->cells[number_of(beside)];
        if (!cell.has_ground()) continue;
        lowest = std::min(lowest, tile->origin + static_cast<double>(cell.mean));
      }
    }
    return lowest;
  }

  PagedTiles<Tile> tiles_;
};

}  // namespace dynains
