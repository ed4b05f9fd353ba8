// Points of a scan within limits of range: their world coordinates and voxels.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <limits>

#include "dynains/evaluation/scan.hpp"
#include "dynains/pose.hpp"
#include "evaluation/detail/voxel_grid.hpp"

namespace dynains::evaluation::detail {

/// Planar range from the sensor of a point within [min_range, max_range], in metres; max_range 0 is
/// no limit.
class RangeGate {
 public:
  RangeGate(double min_range, double max_range)
      : min_squared_(min_range * min_range),
        max_squared_(max_range > 0 ? max_range * max_range : std::numeric_limits<double>::max()) {}

  /// False for points that are not finite and for "no return" (all zero).
  bool passes(const LabelledScan& scan, std::size_t i) const {
    const Eigen::Vector3d p = scan.point(i);
    const bool is_return = p.x() != 0 || p.y() != 0 || p.z() != 0;
    double x = p.x(), y = p.y();
    if (!scan.origins.empty()) {
      const Eigen::Vector3d& origin = scan.origins[scan.sensors == nullptr ? 0 : scan.sensors[i]];
      x -= origin.x();
      y -= origin.y();
    }
    const double squared = x * x + y * y;
    const bool is_inside = (squared >= min_squared_) & (squared <= max_squared_);
    return is_inside & is_return & (std::abs(p.z()) <= std::numeric_limits<double>::max());
  }

 private:
  double min_squared_;
  double max_squared_;
};

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
