// PR, RR and F1 according to ERASOR (Lim et al., RA-L 2021), scan by scan.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <memory>

#include "dynains/evaluation/scan.hpp"
#include "dynains/evaluation/scores.hpp"
#include "dynains/evaluation/truth.hpp"

namespace dynains::evaluation {

/// Labelled point of a voxel map: the centroid of the points in the voxel, with the class of the
/// source point nearest to the centroid. If squared distances differ by at most 1e-8 m^2, the first
/// source point is used.
struct VoxelPoint {
  Eigen::Vector3d p_world;  ///< m
  Truth truth;              ///< static or dynamic
};

/// Compares the maps of several estimates with the raw map of a sequence, scan by scan.
///
/// The raw map contains the points at planar range [min_range, max_range] that are not ignored.
/// Each scan is voxelised on a world grid with edge `voxel` (VoxelPoint); all scans are
/// concatenated and voxelised again. The map of an estimate is computed equally from its kept
/// points. A raw voxel point is preserved if the nearest point of the estimate's map is nearer than
/// voxel * sqrt(3) / 2 and has an equal class.
///
/// The source point nearest to a centroid is known only when the centroid is final, so the protocol
/// needs each scan twice: call add() for each scan, then resolve() for each scan in the order of
/// add(), then score(). Memory is proportional to the number of occupied voxels and independent of
/// the number of scans.
class VoxelProtocol {
 public:
  struct Settings {
    double voxel = 0.2;      ///< m, edge of the grid
    double min_range = 2.7;  ///< m, planar
    double max_range = 0;    ///< m, planar; 0 = no limit
    TruthClasses truth;
  };

  /// Row numbers for score().
  enum Row : std::size_t {
    kIdentity,  ///< no point removed
    kOracle,    ///< exactly the dynamic points removed
    kFirstEstimate
  };

  /// `estimates`: number of estimates. Throws ConfigError for `voxel` <= 0, negative ranges,
  /// min_range above max_range, or more than kMaxEstimates estimates.
  VoxelProtocol(const Settings& settings, std::size_t estimates);
  ~VoxelProtocol();
  VoxelProtocol(VoxelProtocol&&) noexcept;
  VoxelProtocol& operator=(VoxelProtocol&&) noexcept;

  /// First pass. Points that are zero (no return), not finite, or outside of the grid around the
  /// first pose (210 km for voxel = 0.2 m) are excluded from all maps. Throws PoseError if the
  /// first pose is not finite or beyond 10^14 m.
  void add(const LabelledScan& scan);

  /// Second pass. If the scans differ from those of add(), the scores are unspecified.
  void resolve(const LabelledScan& scan);

  /// Score of a row: kIdentity, kOracle, or kFirstEstimate + e.
  VoxelScore score(std::size_t row) const;

  /// Calls `visit` for each voxel point of the raw map (row kIdentity) or of the map of an
  /// estimate.
  void for_each(std::size_t row, const std::function<void(const VoxelPoint&)>& visit) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dynains::evaluation
