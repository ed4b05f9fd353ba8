// World coordinates and voxels of the points of a scan.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "dynains/evaluation/scan.hpp"
#include "dynains/pose.hpp"
#include "evaluation/detail/range_gate.hpp"
#include "evaluation/detail/voxel_grid.hpp"

namespace dynains::evaluation::detail {

/// Written out, so that the sums have one order on all machines.
inline Eigen::Vector3d world_point(const Pose& T_world_sensor, const Eigen::Vector3d& p) {
  Eigen::Vector3d result;
  for (Eigen::Index i = 0; i < 3; ++i) {
    result[i] = T_world_sensor(i, 0) * p.x() + T_world_sensor(i, 1) * p.y() +
                T_world_sensor(i, 2) * p.z() + T_world_sensor(i, 3);
  }
  return result;
}

/// Calls `visit(i, p_world, key)` for the points that pass the gate and lie in the grid.
template <class Visit>
void for_each_point(const LabelledScan& scan, const VoxelGrid& grid, const RangeGate& gate,
                    Visit&& visit) {
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (!gate.passes(scan, i)) continue;
    const Eigen::Vector3d p_world = world_point(scan.T_world_sensor, scan.point(i));
    const VoxelKey key = grid.key(p_world);
    if (key != kNoKey) visit(i, p_world, key);
  }
}

}  // namespace dynains::evaluation::detail
