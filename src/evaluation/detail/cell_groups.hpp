// Points grouped by the voxel they lie in.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "evaluation/detail/voxel_grid.hpp"
#include "evaluation/detail/voxel_index.hpp"

namespace dynains::evaluation::detail {

/// Numbers the occupied voxels of a point set and lists the points of each, in input order.
/// Points outside of the grid are left out.
class CellGroups {
 public:
  CellGroups(const VoxelGrid& grid, Span<const Eigen::Vector3d> points) {
    std::vector<std::uint32_t> cell_of_point(points.size(), VoxelIndex::kNone);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const VoxelKey key = grid.key(points[i]);
      if (key == kNoKey) continue;
      const std::uint32_t cell = index_.insert(key);
      if (cell == keys_.size()) {
        keys_.push_back(key);
        first_.push_back(0);
      }
      ++first_[cell];
      cell_of_point[i] = cell;
    }
    std::uint32_t end = 0;
    for (std::uint32_t& first : first_) {
      end += first;
      first = end;
    }
    first_.push_back(end);
    // Filled from the back, so that every `first_` moves from its group's end to its start.
    points_.resize(end);
    for (std::size_t i = points.size(); i-- > 0;) {
      if (cell_of_point[i] != VoxelIndex::kNone) {
        points_[--first_[cell_of_point[i]]] = static_cast<std::uint32_t>(i);
      }
    }
  }

  const VoxelIndex& index() const { return index_; }
  std::size_t size() const { return keys_.size(); }
  VoxelKey key(std::size_t cell) const { return keys_[cell]; }
  /// Numbers of the points in the cell.
  Span<const std::uint32_t> points(std::size_t cell) const {
    return {points_.data() + first_[cell], first_[cell + 1] - first_[cell]};
  }
  /// Where the cell's points start in an array that follows the grouped order.
  std::size_t first(std::size_t cell) const { return first_[cell]; }
  std::size_t grouped_points() const { return points_.size(); }

 private:
  VoxelIndex index_;
  std::vector<VoxelKey> keys_;
  std::vector<std::uint32_t> first_;
  std::vector<std::uint32_t> points_;
};

}  // namespace dynains::evaluation::detail
