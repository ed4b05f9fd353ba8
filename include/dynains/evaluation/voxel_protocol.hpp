// PR, RR and F1 after ERASOR (Lim et al., RA-L 2021), streaming.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/scores.hpp"
#include "dynains/evaluation/truth.hpp"

namespace dynains::evaluation {

/// One labelled point of a voxel map: the centroid of the points in the voxel, with the class of
/// the source point nearest to it. Squared distances within 1e-8 m^2 are equal; the first point
/// wins.
struct VoxelPoint {
  Eigen::Vector3d p_world;  ///< m
  Truth truth;              ///< static or dynamic
};

/// Compares several estimates with the raw map of a sequence, scan by scan.
///
/// Raw map: points at planar range [min_range, max_range] that are not ignored; each scan is
/// voxelised on the world grid of edge `voxel` (VoxelPoint), all scans are concatenated and
/// voxelised again. The map of an estimate is made in the same way from the points that it keeps. A
/// raw voxel point is preserved if the nearest point of the estimate is nearer than
/// voxel * sqrt(3) / 2 and has the same class.
///
/// The source point nearest to a centroid can be found only when the centroid is final, so each
/// scan is read twice: call add() for every scan, then resolve() for every scan in the same order,
/// then score(). Memory grows with the number of occupied voxels, not with the number of scans.
class VoxelProtocol {
 public:
  struct Settings {
    double voxel = 0.2;      ///< m, edge of the grid
    double min_range = 2.7;  ///< m, planar
    double max_range = 0;    ///< m, planar; 0 = no limit
    TruthClasses truth;
  };

  /// Row numbers for score().
  static constexpr std::size_t kIdentity = 0;  ///< nothing removed
  static constexpr std::size_t kOracle = 1;    ///< exactly the dynamic points removed
  static constexpr std::size_t kFirstEstimate = 2;

  /// Throws ConfigError for an edge that is not positive, ranges that are negative or crossed, or
  /// more than kMaxEstimates estimates.
  VoxelProtocol(const Settings& settings, std::size_t estimates);
  ~VoxelProtocol();
  VoxelProtocol(VoxelProtocol&&) noexcept;
  VoxelProtocol& operator=(VoxelProtocol&&) noexcept;

  /// First pass. Points that are all zero (no return), not finite, or outside of the grid around
  /// the first pose (210 km at 0.2 m) belong to no map. Throws PoseError if the first pose is not
  /// finite or beyond 10^14 m.
  void add(const LabelledScan& scan);

  /// Second pass. The result is undefined, but safe, if the scans differ from those added.
  void resolve(const LabelledScan& scan);

  /// Score of a row: kIdentity, kOracle, or kFirstEstimate + e.
  VoxelScore score(std::size_t row) const;

  /// Calls `visit` for every voxel point of the raw map (row kIdentity) or of an estimate's map.
  void for_each(std::size_t row, const std::function<void(const VoxelPoint&)>& visit) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dynains::evaluation
