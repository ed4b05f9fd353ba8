// Height of the ground of a recording.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
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
      std::array<Cell*, LocatedPoints::kMost> cells;
      for (std::size_t r = 0; r < runs.size(); ++r) {
        cells[r] = &tiles_.at(tile_of(runs[r].cell)).cells[number_of(runs[r].cell)];
        __builtin_prefetch(cells[r], 1);
      }
      for (std::size_t r = 0; r < runs.size(); ++r) {
        for (std::size_t k = runs[r].begin; k < runs[r].end; ++k) cells[r]->add(located.at(k).z());
      }
    });
    free_far(T_world_sensor.translation());
  }

  /// Keeps to the budget, while cells around a sensor (m, world frame) are asked for.
  void free_far(const Eigen::Vector3d& sensor) {
    constexpr double kNear = 60.0;  // m
    tiles_.free_far(sensor, kNear);
  }

  /// Calls `visit(k, cell, rise)` for the located points in cells where the recording has 20 points
  /// of the ground or more. `rise`: m above the ground in the cell.
  template <class Visitor>
  void for_each_rise(const LocatedPoints& located, Visitor&& visit) {
    const Span<const LocatedPoints::Run> runs = located.runs();
    std::array<const Cell*, LocatedPoints::kMost> cells;
    for (std::size_t r = 0; r < runs.size(); ++r) {
      cells[r] = find(runs[r].cell);
      __builtin_prefetch(cells[r]);
    }
    for (std::size_t r = 0; r < runs.size(); ++r) {
      if (!has_ground(cells[r])) continue;
      const double height = cells[r]->height();
      for (std::size_t k = runs[r].begin; k < runs[r].end; ++k)
        visit(k, runs[r].cell, located.at(k).z() - height);
    }
  }

  /// Whether the ground in a cell is not a step above that of any cell around: the underside of a
  /// vehicle can look like ground.
  bool is_level(const WorldCell& cell) {
    constexpr std::int64_t kReach = 2;  // cells
    constexpr double kStep = 0.2;       // m
    const Cell* const own = find(cell);
    if (!has_ground(own)) return false;
    for (std::int64_t dx = -kReach; dx <= kReach; ++dx) {
      for (std::int64_t dy = -kReach; dy <= kReach; ++dy) {
        const Cell* const other = find({cell[0] + dx, cell[1] + dy, 0});
        if (has_ground(other) && own->height() > other->height() + kStep) return false;
      }
    }
    return true;
  }

 private:
  static constexpr std::uint32_t kFewest = 20;

  struct Cell {
    double origin = 0.0;  // m, the first height
    float mean = 0.0F;    // m, above it
    std::uint32_t count = 0;

    double height() const { return origin + static_cast<double>(mean); }
    void add(double z) {
      if (count++ == 0) origin = z;
      mean += (static_cast<float>(z - origin) - mean) / static_cast<float>(count);
    }
  };
  struct Tile {
    std::vector<Cell> cells = std::vector<Cell>(kTileCells * kTileCells);

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

  static std::size_t number_of(const WorldCell& cell) {
    return static_cast<std::size_t>((cell[0] & (kTileCells - 1)) << kTileShift |
                                    (cell[1] & (kTileCells - 1)));
  }
  static bool has_ground(const Cell* cell) { return cell != nullptr && cell->count >= kFewest; }
  // Null: its tile has no ground.
  const Cell* find(const WorldCell& cell) {
    const Tile* const tile = tiles_.find(tile_of(cell));
    return tile == nullptr ? nullptr : &tile->cells[number_of(cell)];
  }

  PagedTiles<Tile> tiles_;
};

}  // namespace dynains
