// Points grouped by the voxels they belong to.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "evaluation/detail/voxel_grid.hpp"

namespace dynains::evaluation::detail {

/// Numbers voxels in the order of their first points and lists the points of each, in input order.
class CellGroups {
 public:
  /// Every point belongs to the voxel it lies in; points outside of the grid are left out.
  CellGroups(const VoxelGrid& grid, Span<const Eigen::Vector3d> points)
      : CellGroups(points.size(), [&](std::size_t i, auto&& add) {
          const VoxelKey key = grid.key(points[i]);
          if (key != kNoKey) add(key);
        }) {}

  /// `for_each_cell(i, add)` calls `add(key)` for the voxels that point i of `count` belongs to.
  template <class ForEachCell>
  CellGroups(std::size_t count, ForEachCell&& for_each_cell) {
    std::vector<std::uint32_t> cells, members;  // by pair of both
    for (std::size_t i = 0; i < count; ++i) {
      for_each_cell(i, [&](VoxelKey key) {
        const std::uint32_t cell = index_.insert(key);
        if (cell == keys_.size()) {
          keys_.push_back(key);
          first_.push_back(0);
        }
        ++first_[cell];
        cells.push_back(cell);
        members.push_back(static_cast<std::uint32_t>(i));
      });
    }
    std::uint32_t end = 0;
    for (std::uint32_t& first : first_) {
      end += first;
      first = end;
    }
    first_.push_back(end);
    // Filled from the back, so that every `first_` moves from its group's end to its start.
    points_.resize(end);
    for (std::size_t k = end; k-- > 0;) points_[--first_[cells[k]]] = members[k];
  }

  /// Numbers of the voxels.
  const VoxelHashTable<>& index() const { return index_; }
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
  VoxelHashTable<> index_;
  std::vector<VoxelKey> keys_;
  std::vector<std::uint32_t> first_;
  std::vector<std::uint32_t> points_;
};

}  // namespace dynains::evaluation::detail
