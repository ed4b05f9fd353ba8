// Lookup of map points near a position.
#pragma once

#include <Eigen/Core>
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
  /// Cells are two radii wide: the eight cells around the nearest corner of a point contain all
  /// points within the radius.
  RadiusLookup(double radius, Span<const Eigen::Vector3d> points)
      : squared_radius_(radius * radius),
        points_(points),
        grid_(2 * radius, anchor_of(points)),
        groups_(grid_, points) {}

  bool contains(const Eigen::Vector3d& p) const {
    const VoxelKey key = grid_.key(p);
    if (key == kNoKey) return false;
    const Eigen::Vector3d center =
        grid_.corner(key) + Eigen::Vector3d::Constant(0.5 * grid_.edge());
    for (unsigned corner = 0; corner < 8; ++corner) {
      const auto step = [&](int axis) {
        if ((corner >> axis & 1U) == 0) return 0;
        return p[axis] < center[axis] ? -1 : 1;
      };
      const VoxelKey neighbour = key + voxel_key_step(step(0), step(1), step(2));
      const std::uint32_t cell = groups_.index().find(neighbour);
      if (cell == VoxelIndex::kNone) continue;
      for (const std::uint32_t i : groups_.points(cell)) {
        if ((points_[i] - p).squaredNorm() <= squared_radius_) return true;
      }
    }
    return false;
  }

 private:
  double squared_radius_;
  Span<const Eigen::Vector3d> points_;
  VoxelGrid grid_;
  CellGroups groups_;
};

}  // namespace dynains::evaluation::detail
