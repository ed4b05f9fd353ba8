// Lookup of map points near a position.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

#include "dynains/points.hpp"
#include "evaluation/detail/cell_groups.hpp"
#include "evaluation/detail/voxel_grid.hpp"

namespace dynains::evaluation::detail {

/// A finite point of the map, as the origin of voxel keys.
inline Eigen::Vector3d anchor_of(Span<const Eigen::Vector3d> points) {
  for (const Eigen::Vector3d& p : points) {
    if (p.allFinite() && p.cwiseAbs().maxCoeff() < 1e9) return p;
  }
  return Eigen::Vector3d::Zero();
}

/// Whether some map point lies within a radius.
class RadiusLookup {
 public:
  RadiusLookup(double radius, Span<const Eigen::Vector3d> points)
      : squared_radius_(radius * radius),
        points_(points),
        grid_(4 * radius, anchor_of(points)),
        cells_(points.size(), [&](std::size_t i, auto&& add) {
          const VoxelKey key = grid_.key(points[i]);
          for (const VoxelKey offset : kNeighbours) {
            const double squared =
                key == kNoKey ? 1e300 : grid_.squared_distance(points[i], key + offset);
            if (squared <= 1.001 * squared_radius_) add(key + offset);  // more than rounding
          }
        }) {}

  const VoxelGrid& grid() const { return grid_; }
  /// Numbers of the cells of grid() with a position near a map point.
  const VoxelIndex& cells() const { return cells_.index(); }
  /// `cell`: number of the cell that contains `p`.
  bool contains(const Eigen::Vector3d& p, std::uint32_t cell) const {
    for (const std::uint32_t i : cells_.points(cell)) {
      if ((points_[i] - p).squaredNorm() <= squared_radius_) return true;
    }
    return false;
  }

 private:
  double squared_radius_;
  Span<const Eigen::Vector3d> points_;
  VoxelGrid grid_;
  CellGroups cells_;  // the map points by all cells in their reach
};

}  // namespace dynains::evaluation::detail
