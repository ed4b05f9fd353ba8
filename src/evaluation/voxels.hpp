// Voxels of a world-aligned grid: the points of scans in them, and which of them a map preserves.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/truth.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::evaluation {

/// Labelled point of a voxel map: the centroid of the points in the voxel, with the class of the
/// source point nearest to the centroid. If squared distances differ by at most 1e-8 m^2, the first
/// source point is used.
struct VoxelPoint {
  Eigen::Vector3d p_world;  ///< m
  Truth truth;              ///< static or dynamic
};

namespace detail {

/// Key of points outside of the grid.
inline constexpr VoxelKey kNoKey = ~VoxelKey{0};

/// Cells [i * edge, (i + 1) * edge) per axis of the world frame. Keys count from the cell of an
/// anchor point, so that large coordinates (UTM) fit; the grid itself does not move with it.
class VoxelGrid {
 public:
  /// Throws PoseError if the cell number of the anchor cannot be exact.
  VoxelGrid(double edge, const Eigen::Vector3d& anchor) : edge_(edge) {
    for (int axis = 0; axis < 3; ++axis) {
      const double cell = std::floor(anchor[axis] / edge);
      if (!(std::abs(cell) < 0x1p50)) {
        throw PoseError("the first pose lies too far from the world's origin for a grid of " +
                        std::to_string(edge) + " m");
      }
      anchor_[axis] = cell;
    }
  }

  double edge() const { return edge_; }

  /// kNoKey for a point that is not finite or that lies 2^20 cells or more from the anchor along
  /// some axis (210 km at 0.2 m). One cell at either end is kept free for the neighbours.
  VoxelKey key(const Eigen::Vector3d& p_world) const {
    const Eigen::Array3d cell = (p_world / edge_).array().floor() - anchor_;
    constexpr auto kEnd = static_cast<double>(kVoxelKeyOffset - 1);
    if (!(cell >= -kEnd && cell < kEnd).all()) return kNoKey;
    const auto index = [&](Eigen::Index axis) { return static_cast<std::int64_t>(cell[axis]); };
    return voxel_key(index(0), index(1), index(2));
  }

  /// Lower corner of a voxel.
  Eigen::Vector3d corner(VoxelKey key) const {
    Eigen::Vector3d corner;
    for (int axis = 0; axis < 3; ++axis) {
      const auto number = static_cast<double>(voxel_index(key, axis));
      corner[axis] = (number + anchor_[axis]) * edge_;
    }
    return corner;
  }

  /// Squared distance from a point to the cube of a voxel, m^2.
  double squared_distance(const Eigen::Vector3d& p_world, VoxelKey key) const {
    const Eigen::Vector3d local = p_world - corner(key);
    return (local - local.cwiseMax(0.0).cwiseMin(edge_)).squaredNorm();
  }

 private:
  double edge_;
  Eigen::Array3d anchor_;  // cell numbers
};

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
