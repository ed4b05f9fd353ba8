// Preservation of a raw voxel point (ERASOR's protocol).
#pragma once

#include <Eigen/Core>
#include <optional>

#include "dynains/evaluation/voxel_protocol.hpp"
#include "evaluation/detail/voxel_grid.hpp"
#include "evaluation/detail/voxel_index.hpp"

namespace dynains::evaluation::detail {

/// Whether a squared distance (m^2) is less than the best one by more than rounding. The two points
/// of a voxel with two points are equally near to its centroid: without a margin, rounding would
/// choose the class, and another world frame would change the score. 1e-8 m^2 is 50 nm at 0.1 m;
/// rounding of coordinates of 5e6 m (UTM) is 1 nm.
constexpr bool is_nearer(double squared, double best) { return squared + 1e-8 < best; }

/// Whether the estimate's point nearest to `raw` is nearer than edge * sqrt(3) / 2 and has the same
/// class. `key`: voxel of `raw` in `grid`; `point_at(number)`: the estimate's point in voxel
/// `number` of `index`, a std::optional<VoxelPoint>.
///
/// Exact: the radius is less than an edge, so the nearest point is in the 27 voxels around `raw`.
/// The margin of 0.13 edges exceeds the rounding of a centroid.
template <class PointAt>
bool is_preserved(const VoxelPoint& raw, VoxelKey key, const VoxelGrid& grid,
                  const VoxelIndex& index, PointAt&& point_at) {
  const double squared_edge = grid.edge() * grid.edge();
  const double rounding = 1e-6 * squared_edge;  // of a centroid at a face of its voxel
  double nearest = 0.75 * squared_edge;
  bool same = false;
  const auto compare = [&](VoxelKey at) {
    const std::uint32_t number = index.find(at);
    if (number == VoxelIndex::kNone) return;
    const std::optional<VoxelPoint> candidate = point_at(number);
    if (!candidate) return;
    const double distance = (candidate->p_world - raw.p_world).squaredNorm();
    if (!(distance < nearest)) return;
    nearest = distance;
    same = candidate->truth == raw.truth;
  };
  compare(key);
  if (nearest == 0) return same;

  const Eigen::Vector3d from_corner = raw.p_world - grid.corner(key);
  const auto is_in_reach = [&](double squared_distance) {
    return squared_distance <= nearest + rounding;
  };
  const auto squared_gap = [&](int axis, int step) {
    const double below = from_corner[axis];
    const double gap = step < 0 ? below : step > 0 ? grid.edge() - below : 0.0;
    return gap * gap;
  };
  const auto for_each_neighbour_in_reach = [&](auto&& visit) {
    for (int z = -1; z <= 1; ++z) {
      for (int y = -1; y <= 1; ++y) {
        const double squared = squared_gap(2, z) + squared_gap(1, y);
        if (!is_in_reach(squared)) continue;
        for (int x = -1; x <= 1; ++x) {
          if (x == 0 && y == 0 && z == 0) continue;
          if (is_in_reach(squared + squared_gap(0, x))) visit(key + voxel_key_step(x, y, z));
        }
      }
    }
  };
  for_each_neighbour_in_reach([&](VoxelKey at) { index.prefetch(at); });
  for_each_neighbour_in_reach(compare);
  return same;
}

inline void count(VoxelScore& score, Truth truth, bool preserved) {
  if (truth == Truth::kStatic) {
    ++score.static_total;
    score.static_preserved += preserved;
  } else {
    ++score.dynamic_total;
    score.dynamic_preserved += preserved;
  }
}

}  // namespace dynains::evaluation::detail
