// Preservation of a raw voxel point (ERASOR's protocol).
#pragma once

#include <Eigen/Core>
#include <optional>

#include "detail/voxel_grid.hpp"
#include "dynains/evaluation/voxel_protocol.hpp"

namespace dynains::evaluation::detail {

/// Whether the estimate's point nearest to `raw` is nearer than edge * sqrt(3) / 2 and has the same
/// class. `key`: voxel of `raw`; `point_at(number)`: the estimate's point in voxel `number` of
/// `index`, a std::optional<VoxelPoint>.
///
/// Exact: the radius is less than an edge, so the nearest point is in the 27 voxels around `raw`.
/// The margin of 0.13 edges exceeds the rounding of a centroid.
template <class PointAt>
bool is_preserved(const VoxelPoint& raw, VoxelKey key, double edge, const VoxelIndex& index,
                  PointAt&& point_at) {
  double nearest = 0.75 * edge * edge;
  bool same = false;
  for (const VoxelKey offset : kNeighbours) {
    const std::uint32_t number = index.find(key + offset);
    if (number == VoxelIndex::kNone) continue;
    const std::optional<VoxelPoint> candidate = point_at(number);
    if (!candidate) continue;
    const double distance = (candidate->p_world - raw.p_world).squaredNorm();
    if (distance < nearest) {
      nearest = distance;
      same = candidate->truth == raw.truth;
      if (distance == 0) break;
    }
  }
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
