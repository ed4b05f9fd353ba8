// Preservation of a raw voxel point (ERASOR's protocol).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "dynains/evaluation/scores.hpp"
#include "dynains/evaluation/truth.hpp"
#include "evaluation/detail/voxel_grid.hpp"

namespace dynains::evaluation {

/// Labelled point of a voxel map: the centroid of the points in the voxel, with the class of the
/// source point nearest to the centroid. If squared distances differ by at most 1e-8 m^2, the first
/// source point is used.
struct VoxelPoint {
  Eigen::Vector3d p_world;  ///< m
  Truth truth;              ///< static or dynamic
};

namespace detail {

/// Set of Truth values, one bit each.
using TruthMask = std::uint8_t;
constexpr TruthMask truth_bit(Truth truth) {
  return static_cast<TruthMask>(1U << static_cast<unsigned>(truth));
}
/// Whether points of more than one class were added.
constexpr bool is_mixed(TruthMask truths) { return (truths & (truths - 1)) != 0; }

/// Whether a squared distance (m^2) is less than the best one by more than rounding. The two points
/// of a voxel with two points are equally near to its centroid: without a margin, rounding would
/// choose the class, and another world frame would change the score. 1e-8 m^2 is 50 nm at 0.1 m;
/// rounding of coordinates of 5e6 m (UTM) is 1 nm.
constexpr bool is_nearer(double squared, double best) { return squared + 1e-8 < best; }

/// The centroid of points of one voxel and the class of the nearest one; empty without points.
/// `for_each(add)` calls `add(p_world, truth)` for each of them, in one order at each call.
template <class ForEach>
std::optional<VoxelPoint> voxel_point(ForEach&& for_each) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::size_t count = 0;
  for_each([&](const Eigen::Vector3d& p_world, Truth) {
    sum += p_world;
    ++count;
  });
  if (count == 0) return std::nullopt;
  VoxelPoint point{sum / static_cast<double>(count), Truth::kStatic};
  double nearest = std::numeric_limits<double>::infinity();
  for_each([&](const Eigen::Vector3d& p_world, Truth truth) {
    const double squared = (p_world - point.p_world).squaredNorm();
    if (!is_nearer(squared, nearest)) return;
    nearest = squared;
    point.truth = truth;
  });
  return point;
}

/// Whether the estimate's point nearest to `raw` is nearer than edge * sqrt(3) / 2 and has the same
/// class. `key`: voxel of `raw` in `grid`; `point_at(number)`: the estimate's point in voxel
/// `number` of `index`, a std::optional<VoxelPoint>.
///
/// Exact: the radius is less than an edge, so the nearest point is in the 27 voxels around `raw`.
template <class PointAt>
bool is_preserved(const VoxelPoint& raw, VoxelKey key, const VoxelGrid& grid,
                  const VoxelHashTable<>& index, PointAt&& point_at) {
  const double squared_edge = grid.edge() * grid.edge();
  const double rounding = 1e-6 * squared_edge;  // of a centroid at a face of its voxel
  double nearest = 0.75 * squared_edge;
  bool same = false;
  const auto compare = [&](VoxelKey at) {
    if (grid.squared_distance(raw.p_world, at) > nearest + rounding) return;
    const std::uint32_t number = index.find(at);
    if (number == kNoIndex) return;
    const std::optional<VoxelPoint> candidate = point_at(number);
    if (!candidate) return;
    const double distance = (candidate->p_world - raw.p_world).squaredNorm();
    if (!(distance < nearest)) return;
    nearest = distance;
    same = candidate->truth == raw.truth;
  };
  compare(key);
  if (nearest > 0) for_each_touching(key, compare);
  return same;
}

}  // namespace detail
}  // namespace dynains::evaluation
