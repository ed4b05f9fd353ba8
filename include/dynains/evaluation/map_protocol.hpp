// Both protocols for a finished map of unlabelled points, such as a map file of another tool.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>

#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/scores.hpp"
#include "dynains/evaluation/truth.hpp"
#include "dynains/evaluation/voxel_protocol.hpp"
#include "dynains/points.hpp"

namespace dynains::evaluation {

/// Evaluates map points by the scans that the map was made from.
///
/// Voxel-wise: a map point has the class of the nearest measured point within the 27 voxels around
/// it; a measured point nearer than one voxel edge is always found. Map points without a measured
/// point there (out of range, or in another frame) are left out, and so are map points whose
/// nearest measured point is ignored. The other map points are voxelised and compared as in
/// VoxelProtocol. Point-wise: a measured point is removed if no map point lies within
/// `point_radius`.
///
/// Call add() for every scan, then resolve() for every scan again. Memory grows with the number of
/// map points and occupied voxels only.
class MapProtocol {
 public:
  struct Settings {
    double voxel = 0.2;           ///< m
    double min_range = 2.7;       ///< m, planar
    double max_range = 0;         ///< m, planar; 0 = no limit
    double point_max_range = 50;  ///< m, planar; 0 = no limit; point-wise only
    double point_radius = 0.05;   ///< m
    TruthClasses truth;
  };

  /// `map_world`: points in the world frame of the poses, m; must outlive this object. Points that
  /// are not finite are left out. Throws ConfigError for settings out of bounds.
  MapProtocol(const Settings& settings, Span<const Eigen::Vector3d> map_world);
  ~MapProtocol();
  MapProtocol(MapProtocol&&) noexcept;
  MapProtocol& operator=(MapProtocol&&) noexcept;

  void add(const LabelledScan& scan);
  void resolve(const LabelledScan& scan);

  /// Score against the raw map of `raw`, which must have the same scans and settings.
  VoxelScore voxel_score(const VoxelProtocol& raw) const;
  PointScore point_score() const;

  /// Map points that were left out because no measured point is near. If these are most of the map,
  /// it is probably in another frame than the poses.
  std::uint64_t foreign_points() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dynains::evaluation
