// Both protocols for a map of unlabelled points, such as a map file of another program.
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
  struct Settings {
    double voxel = 0.2;           ///< m
    double min_range = 2.7;       ///< m, planar
    double max_range = 0;         ///< m, planar; 0 = no limit
    double point_max_range = 50;  ///< m, planar; 0 = no limit; point-wise only
    double point_radius = 0.05;   ///< m
    TruthClasses truth;
  };

  /// `map_world`: points, m, world frame of the poses; must outlive this object. Points that are
  /// not finite are excluded. Throws ConfigError for settings out of bounds.
  MapProtocol(const Settings& settings, Span<const Eigen::Vector3d> map_world);
  ~MapProtocol();
  MapProtocol(MapProtocol&&) noexcept;
  MapProtocol& operator=(MapProtocol&&) noexcept;

  void add(const LabelledScan& scan);      ///< first pass
  void resolve(const LabelledScan& scan);  ///< second pass

  /// Score relative to the raw map of `raw`, which must have equal scans and settings.
  VoxelScore voxel_score(const VoxelProtocol& raw) const;
  PointScore point_score() const;

  /// Number of map points that are excluded because no measured point is near. If most map points
  /// are excluded, the map is probably not in the world frame of the poses.
  std::uint64_t foreign_points() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dynains::evaluation
