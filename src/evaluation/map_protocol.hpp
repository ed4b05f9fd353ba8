// Both protocols for a map of unlabelled points, such as a map file of another program.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "dynains/evaluation/config.hpp"
#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/scores.hpp"
#include "dynains/evaluation/truth.hpp"
#include "dynains/points.hpp"
#include "evaluation/voxel_protocol.hpp"
#include "evaluation/voxels.hpp"

namespace dynains::evaluation {
namespace detail {

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

}  // namespace detail

/// Evaluates a map by the scans from which it was built.
///
/// Voxel-wise (PR, RR): a map point gets the class of the nearest measured point within the 27
/// voxels around it, which contain all measured points nearer than one voxel edge. Map points
/// without such a measured point (out of range, or in another frame), or with an ignored one, are
/// excluded. The other map points are voxelised and compared as in VoxelProtocol. Point-wise (SA,
/// DA): a measured point is removed if no map point lies within `point_radius`.
///
/// Call add() for each scan, then resolve() for each scan. Memory is proportional to the numbers of
/// map points and occupied voxels.
class MapProtocol {
 public:
  /// `map_world`: points, m, world frame of the poses; must outlive this object. Points that are
  /// not finite are excluded.
  MapProtocol(const EvaluationConfig& config, Span<const Eigen::Vector3d> map_world)
      : config_(config),
        gate_(config.min_range, config.max_range),
        point_gate_(config.min_range, config.point_max_range),
        map_(map_world),
        grid_(config.voxel, detail::anchor_of(map_world)),
        groups_(grid_, map_world),
        lookup_(config.point_radius, map_world) {}

  /// First pass.
  void add(const LabelledScan& scan) {
    detail::for_each_point(
        scan, grid_, gate_, [&](std::size_t i, const Eigen::Vector3d&, VoxelKey key) {
          const std::uint32_t number = measured_.insert(key);
          if (number == measured_truths_.size()) measured_truths_.push_back(0);
          measured_truths_[number] |= detail::truth_bit(config_.truth(scan.truth[i]));
        });
    detail::for_each_point(scan, lookup_.grid(), point_gate_,
                           [&](std::size_t i, const Eigen::Vector3d& p, VoxelKey key) {
                             const Truth truth = config_.truth(scan.truth[i]);
                             if (truth == Truth::kIgnored) return;
                             point_score_.add(truth, 1, lookup_.contains(p, key) ? 1 : 0);
                           });
    finished_first_pass_ = false;
  }
  /// Second pass.
  void resolve(const LabelledScan& scan) {
    finish_first_pass();
    detail::for_each_point(scan, grid_, gate_,
                           [&](std::size_t i, const Eigen::Vector3d& p, VoxelKey key) {
                             if (near_mixed_.find(key) == kNoIndex) return;
                             approach({p, config_.truth(scan.truth[i])}, key);
                           });
  }

  /// Score relative to the raw map of `raw`, which must have equal scans and settings.
  Score voxel_score(const VoxelProtocol& raw) {
    finish_first_pass();
    std::vector<std::optional<VoxelPoint>> estimate(groups_.size());
    for (std::size_t cell = 0; cell < groups_.size(); ++cell) estimate[cell] = voxel_point(cell);
    const auto point_at = [&](std::uint32_t cell) { return estimate[cell]; };
    Score score;
    raw.for_each(kIdentity, [&](const VoxelPoint& point) {
      const VoxelKey key = grid_.key(point.p_world);
      const bool is_kept = key != detail::kNoKey &&
                           detail::is_preserved(point, key, grid_, groups_.index(), point_at);
      score.add(point.truth, 1, is_kept ? 1 : 0);
    });
    return score;
  }
  const Score& point_score() const { return point_score_; }

  /// Number of map points that are excluded because no measured point is near. If most map points
  /// are excluded, the map is probably not in the world frame of the poses.
  std::uint64_t foreign_points() {
    finish_first_pass();
    std::uint64_t foreign = map_.size() - groups_.grouped_points();
    for (std::size_t cell = 0; cell < groups_.size(); ++cell) {
      if (truths_[cell] == 0) foreign += groups_.points(cell).size();
    }
    return foreign;
  }

 private:
  static constexpr double kFar = std::numeric_limits<double>::infinity();

  /// A map point in a mixed map voxel: measured points around it have more than one class.
  struct Mixed {
    double nearest = kFar;  // squared distance to the nearest measured point, m^2
    Truth truth = Truth::kIgnored;
  };

  // Collects the classes of measured points around each map voxel. One class decides the points of
  // the voxel; mixed voxels are decided by resolve().
  void finish_first_pass() {
    if (finished_first_pass_) return;
    finished_first_pass_ = true;
    truths_.assign(groups_.size(), 0);
    farthest_.assign(groups_.size(), kFar);
    mixed_.assign(groups_.grouped_points(), {});
    near_mixed_ = VoxelHashTable<>();
    for (std::size_t cell = 0; cell < groups_.size(); ++cell) {
      for_each_touching(groups_.key(cell), [&](VoxelKey key) {
        const std::uint32_t number = measured_.find(key);
        if (number != kNoIndex) truths_[cell] |= measured_truths_[number];
      });
      if (!detail::is_mixed(truths_[cell])) continue;
      for_each_touching(groups_.key(cell), [&](VoxelKey key) { near_mixed_.insert(key); });
    }
  }
  // Updates the nearest measured point of the map points in mixed voxels around a point.
  void approach(const VoxelPoint& point, VoxelKey key) {
    for_each_touching(key, [&](VoxelKey at) {
      const std::uint32_t cell = groups_.index().find(at);
      if (cell == kNoIndex || !detail::is_mixed(truths_[cell])) return;
      // Skips voxels whose map points have nearer measured points already: most, in dense maps.
      if (grid_.squared_distance(point.p_world, at) >= farthest_[cell]) return;
      double farthest = 0;
      for (std::size_t rank = 0; rank < groups_.points(cell).size(); ++rank) {
        const Eigen::Vector3d& p = map_[groups_.points(cell)[rank]];
        Mixed& mixed = mixed_[groups_.first(cell) + rank];
        const double squared = (p - point.p_world).squaredNorm();
        if (squared < mixed.nearest) mixed = {squared, point.truth};
        farthest = std::max(farthest, mixed.nearest);
      }
      farthest_[cell] = farthest;
    });
  }
  Truth truth_of(std::size_t cell, std::size_t rank) const {
    if (detail::is_mixed(truths_[cell])) return mixed_[groups_.first(cell) + rank].truth;
    if (truths_[cell] == detail::truth_bit(Truth::kStatic)) return Truth::kStatic;
    return truths_[cell] == detail::truth_bit(Truth::kDynamic) ? Truth::kDynamic : Truth::kIgnored;
  }
  std::optional<VoxelPoint> voxel_point(std::size_t cell) const {
    const Span<const std::uint32_t> points = groups_.points(cell);
    return detail::voxel_point([&](auto&& add) {
      for (std::size_t rank = 0; rank < points.size(); ++rank) {
        const Truth truth = truth_of(cell, rank);
        if (truth != Truth::kIgnored) add(map_[points[rank]], truth);
      }
    });
  }

  EvaluationConfig config_;
  detail::RangeGate gate_;
  detail::RangeGate point_gate_;
  Span<const Eigen::Vector3d> map_;
  detail::VoxelGrid grid_;
  detail::CellGroups groups_;
  detail::RadiusLookup lookup_;
  Score point_score_;

  VoxelHashTable<> measured_;  // voxels that contain measured points
  std::vector<detail::TruthMask> measured_truths_;

  bool finished_first_pass_ = false;
  std::vector<detail::TruthMask> truths_;  // by map voxel: classes of the measured points around it
  VoxelHashTable<> near_mixed_;            // mixed map voxels and their neighbours
  std::vector<Mixed> mixed_;               // by map point, in the order of groups_
  std::vector<double> farthest_;           // by map voxel: largest Mixed::nearest
};

}  // namespace dynains::evaluation
