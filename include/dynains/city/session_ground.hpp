// The ground of several sessions in one tile of a map.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "dynains/city/session_grid.hpp"
#include "dynains/city/session_points.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::detail {

/// Lowest ground points, in cells of 1 m.
class LowestGround {
 public:
  void add(const SessionPoint& point) {
    const std::uint32_t cell = cells_.insert(key_of(point));
    if (cell == z_.size()) z_.push_back(point.z);
    z_[cell] = std::min(z_[cell], point.z);
  }
  /// m, in the cell of a point and those that touch it; the largest float if there is none.
  float lowest_around(const SessionPoint& point) const {
    float lowest = std::numeric_limits<float>::max();
    for (int i = 0; i < 9; ++i) {
      const std::uint32_t cell =
          cells_.find(key_of(point) + voxel_key_step(i % 3 - 1, i / 3 - 1, 0));
      if (cell != VoxelHashTable<>::kNone) lowest = std::min(lowest, z_[cell]);
    }
    return lowest;
  }

 private:
  static VoxelKey key_of(const SessionPoint& point) {
    constexpr float kCell = 1.0F;  // m
    return voxel_key(static_cast<std::int64_t>(point.x / kCell),
                     static_cast<std::int64_t>(point.y / kCell), 0);
  }

  VoxelHashTable<> cells_;
  std::vector<float> z_;  // m, by cell
};

/// Tells points with the verdict "ground" that belong to objects: low parts of a car, for example.
class SessionGround {
 public:
  explicit SessionGround(const SessionGrid& grid) : grid_(grid) {}

  /// Adds the points of a session. Returns its own ground.
  LowestGround add(std::uint32_t session, const std::vector<SessionPoint>& points) {
    LowestGround own;
    for (const SessionPoint& point : points) {
      const std::uint32_t flat = flat_cells_.insert(flat_cell(point));
      if (flat == filled_by_.size()) filled_by_.push_back({session});
      filled_by_[flat].add(session);
      if (!point.is_ground) continue;
      own.add(point);
      lowest_.add(point);
      const std::uint32_t low = low_cells_.insert(low_cell(point));
      if (low == low_ground_.size()) low_ground_.push_back({point.z, {session}});
      low_ground_[low].z = std::min(low_ground_[low].z, point.z);
      low_ground_[low].sessions.add(session);
    }
    return own;
  }

  /// Whether the lowest ground around is at least 0.35 m below a point.
  bool is_below(const SessionPoint& point) const {
    constexpr float kRise = 0.35F;  // m
    return point.z > lowest_.lowest_around(point) + kRise;
  }

  /// Whether a ground point of a session is an object's: above the ground that another session saw
  /// beside it, at a height where no other session has a point. The ground has one height, and the
  /// session itself saw it around. `own`: ground of this session.
  bool is_unconfirmed(std::uint32_t session, const LowestGround& own,
                      const SessionPoint& point) const {
    return point.is_ground && is_above_other_ground(session, point) &&
           own.lowest_around(point) <= lowest_.lowest_around(point) + kLowRise &&
           !is_confirmed(session, point);
  }

 private:
  static constexpr float kLowRise = 0.1F;  // m above the lowest ground of low cells

  /// The sessions that have measured a place, as far as it matters.
  struct SeenBy {
    std::uint32_t first;
    bool has_others = false;

    void add(std::uint32_t session) { has_others = has_others || session != first; }
    bool has_other_than(std::uint32_t session) const { return has_others || session != first; }
  };
  struct LowGround {
    float z;  // m
    SeenBy sessions;
  };

  static VoxelKey low_cell(const SessionPoint& point) {
    constexpr double kCell = 0.4;  // m
    return voxel_key(static_cast<std::int64_t>(static_cast<double>(point.x) / kCell),
                     static_cast<std::int64_t>(static_cast<double>(point.y) / kCell), 0);
  }

  // A voxel of less height.
  VoxelKey flat_cell(const SessionPoint& point) const {
    constexpr double kHeight = 0.05;  // m
    const VoxelKey voxel = session_voxel(grid_, point);
    const double layer = std::floor(static_cast<double>(point.z) / kHeight);
    return voxel_key(voxel_index(voxel, 0), voxel_index(voxel, 1),
                     static_cast<std::int64_t>(layer));
  }

  bool is_above_other_ground(std::uint32_t session, const SessionPoint& point) const {
    for (int i = 0; i < 9; ++i) {
      const std::uint32_t cell =
          low_cells_.find(low_cell(point) + voxel_key_step(i % 3 - 1, i / 3 - 1, 0));
      if (cell == VoxelHashTable<>::kNone) continue;
      const LowGround& ground = low_ground_[cell];
      if (ground.sessions.has_other_than(session) && point.z > ground.z + kLowRise) return true;
    }
    return false;
  }

  bool is_confirmed(std::uint32_t session, const SessionPoint& point) const {
    const VoxelKey key = flat_cell(point);
    for (int i = 0; i < 27; ++i) {
      const std::uint32_t flat =
          flat_cells_.find(key + voxel_key_step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
      if (flat != VoxelHashTable<>::kNone && filled_by_[flat].has_other_than(session)) return true;
    }
    return false;
  }

  SessionGrid grid_;
  LowestGround lowest_;
  VoxelHashTable<> low_cells_;
  std::vector<LowGround> low_ground_;  // by low cell
  VoxelHashTable<> flat_cells_;        // with points of any session
  std::vector<SeenBy> filled_by_;      // by flat cell
};

}  // namespace dynains::detail
