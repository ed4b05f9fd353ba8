// Selection of the changes between two states of a map of many sessions.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/city/session_points.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// A point that stands in one state of a tile and not in the other.
struct ChangedPoint {
  SessionPoint point;
  std::uint32_t hits;      ///< references of its own session that hit its place
  bool is_passed = false;  ///< whether beams of its own session passed through its place, too
};

/// Finds the clusters of changed points that are objects: larger than 0.5 m, seen standing by
/// their own session all the time, and not a part of something that stands in both states.
class ChangeClusters {
 public:
  explicit ChangeClusters(const SessionGrid& grid) : grid_((grid.validate(), grid)) {}

  /// Adds a point above the ground that stands in both states.
  void add_standing(const SessionPoint& point) { standing_.insert(cell_of(point)); }

  /// Tells for each point whether it belongs to an object. Points in touching cells of two voxels
  /// form a cluster.
  std::vector<bool> select(const std::vector<ChangedPoint>& points) const {
    VoxelHashTable<> cells;
    std::vector<VoxelKey> keys;
    std::vector<std::vector<std::uint32_t>> members;  // points, by cell
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      const VoxelKey key = cell_of(points[i].point);
      const std::uint32_t cell = cells.insert(key);
      if (cell == keys.size()) {
        keys.push_back(key);
        members.emplace_back();
      }
      members[cell].push_back(i);
    }
    std::vector<bool> is_selected(points.size(), false), is_done(keys.size(), false);
    std::vector<std::uint32_t> cluster;
    for (std::uint32_t first = 0; first < keys.size(); ++first) {
      if (is_done[first]) continue;
      is_done[first] = true;
      cluster.assign(1, first);
      Shape shape;
      for (std::size_t i = 0; i < cluster.size(); ++i) {
        bool touches_standing = false;
        for (int k = 0; k < 27; ++k) {
          const VoxelKey key =
              keys[cluster[i]] + voxel_key_step(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
          touches_standing = touches_standing || standing_.find(key) != VoxelHashTable<>::kNone;
          const std::uint32_t next = cells.find(key);
          if (next == VoxelHashTable<>::kNone || is_done[next]) continue;
          is_done[next] = true;
          cluster.push_back(next);
        }
        if (touches_standing) ++shape.contacts;
        for (const std::uint32_t point : members[cluster[i]]) shape.add(points[point]);
      }
      if (!is_object(shape, cluster.size())) continue;
      for (const std::uint32_t cell : cluster) {
        for (const std::uint32_t point : members[cell]) is_selected[point] = true;
      }
    }
    return is_selected;
  }

 private:
  static constexpr float kLeastExtent = 0.5F;  // m
  static constexpr float kLeastHeight = 0.4F;  // m
  static constexpr std::size_t kLeastCells = 8;
  static constexpr float kLeastHits = 3.0F;    // references, mean of the points
  static constexpr float kMostPassed = 0.05F;  // ratio of the points
  static constexpr float kMostContact = 0.7F;  // ratio of the cells beside what stands to all

  struct Shape {
    float lowest[3] = {1e9F, 1e9F, 1e9F}, highest[3] = {-1e9F, -1e9F, -1e9F};  // m
    std::size_t points = 0, hits = 0, passed = 0;
    std::size_t contacts = 0;  // cells beside what stands

    void add(const ChangedPoint& changed) {
      const float at[3] = {changed.point.x, changed.point.y, changed.point.z};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        lowest[axis] = std::min(lowest[axis], at[axis]);
        highest[axis] = std::max(highest[axis], at[axis]);
      }
      ++points;
      hits += changed.hits;
      passed += changed.is_passed ? 1 : 0;
    }
  };

  static bool is_object(const Shape& shape, std::size_t cells) {
    const float height = shape.highest[2] - shape.lowest[2];
    const float extent =
        std::max({height, shape.highest[0] - shape.lowest[0], shape.highest[1] - shape.lowest[1]});
    return cells >= kLeastCells && extent > kLeastExtent && height > kLeastHeight &&
           static_cast<float>(shape.hits) >= kLeastHits * static_cast<float>(shape.points) &&
           static_cast<float>(shape.passed) <= kMostPassed * static_cast<float>(shape.points) &&
           static_cast<float>(shape.contacts) <= kMostContact * static_cast<float>(cells);
  }

  VoxelKey cell_of(const SessionPoint& point) const {
    const VoxelKey voxel = session_voxel(grid_, point);
    return voxel_key(voxel_index(voxel, 0) >> 1, voxel_index(voxel, 1) >> 1,
                     voxel_index(voxel, 2) >> 1);
  }

  SessionGrid grid_;
  VoxelHashTable<> standing_;
};

}  // namespace dynains
