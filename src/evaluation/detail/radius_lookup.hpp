// Points of a map within a radius.
#pragma once

#include <Eigen/Core>
#include <algorithm>
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
          if (key == kNoKey) return;
          for_each_touching(key, [&](VoxelKey at) {  // more than rounding
            if (grid_.squared_distance(points[i], at) <= 1.001 * squared_radius_) add(at);
          });
        }) {}

  const VoxelGrid& grid() const { return grid_; }
  /// `key`: that of `p` in grid().
  bool contains(const Eigen::Vector3d& p, VoxelKey key) const {
    const std::uint32_t cell = cells_.index().find(key);
    if (cell == kNoIndex) return false;
    const Span<const std::uint32_t> near = cells_.points(cell);
    return std::any_of(near.begin(), near.end(), [&](std::uint32_t i) {
      return (points_[i] - p).squaredNorm() <= squared_radius_;
    });
  }

 private:
  double squared_radius_;
  Span<const Eigen::Vector3d> points_;
  VoxelGrid grid_;
  CellGroups cells_;  // the map points by all cells in their reach
};

}  // namespace dynains::evaluation::detail
