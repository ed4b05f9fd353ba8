// Visits of a recording: parts whose scans fit to each other.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "dynains/evidence/free_space_config.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/byte_store.hpp"
#include "dynains/registration/plane_aligner.hpp"
#include "dynains/registration/voxel_planes.hpp"
#include "dynains/verdict.hpp"

namespace dynains {

/// A return to a place: a scan near earlier scans of a visit, aligned with their planes.
struct ReturnToPlace {
  std::uint32_t earlier, later;             ///< numbers of scans; `earlier` is the nearest
  Pose T_earlier_later = Pose::Identity();  ///< as the surfaces fit
  /// Covariance of the translation (m) and the rotation (rad) of T_earlier_later, along the axes of
  /// the later sensor, row by row.
  std::array<double, 36> covariance = {};
  double distance = 0.0;  ///< m, between the two sensors
  double inliers = 1.0;   ///< share of the points in voxels with a plane
  double movement = 0.0;  ///< m, by which the alignment moves points 10 m away
  /// Standard deviation of that movement along its least certain direction, m; infinity: no surface
  /// is in both
  double deviation = std::numeric_limits<double>::infinity();

  /// Whether the scans fit well enough for the margins of the evidence: movement and deviation are
  /// small, and most points are inliers.
  bool fits() const;
  /// Whether they do not fit. If neither, the surfaces do not determine it.
  bool is_wrong() const;
  /// Whether T_earlier_later is certain.
  bool is_known() const;
};

/// Divides a recording into visits. Key scans, one per 2 m of way, are aligned with the key scans
/// of each visit that are within 60 m and too old for the first pass to have compared them. A key
/// scan joins a visit that it fits, preferably its current one. Otherwise it begins a visit if it
/// begins an epoch, if it does not fit its current visit, or if it is within 8 m of that visit and
/// the surfaces do not determine whether it fits.
class Returns {
 public:
  /// `store` holds points of the scans and must outlive this object. `evidence`: of the first pass.
  Returns(ByteStore& store, const FreeSpaceConfig& evidence)
      : store_(store),
        compared_(1 +
                  static_cast<std::uint32_t>(evidence.lookback_scans + evidence.lookahead_scans)) {}

  /// Takes the next scan: points (m, sensor frame) with their verdicts. Returns its visit, numbered
  /// from 0; a new one has the next number. Throws what the store throws.
  std::uint32_t add(PointsView points, Span<const PointLabel> verdicts, const ComparedPose& pose);

  /// Number of consecutive scans that the first pass compares with each other.
  std::uint32_t compared() const { return compared_; }
  /// All alignments.
  const std::vector<ReturnToPlace>& found() const { return found_; }

 private:
  struct KeyScan {
    std::uint32_t scan, visit;
    Pose T_world_sensor;
    std::uint64_t offset;  // in the store
    std::size_t size;      // bytes
  };

  bool is_key(const Eigen::Vector3d& sensor, bool begins);
  void keep(PointsView points, Span<const PointLabel> verdicts);
  void choose_near(std::uint32_t visit, const Eigen::Vector3d& sensor);
  void choose_visit(const Pose& T_world_sensor);
  detail::VoxelPlanes find_planes(double edge);
  ReturnToPlace aligned(const Pose& T_world_sensor);
  ReturnToPlace aligned_from(const Pose& T_guess, const Pose& T_given,
                             detail::VoxelPlanes& planes) const;

  ByteStore& store_;
  std::uint32_t compared_;
  std::uint32_t scans_ = 0, visits_ = 0;
  std::uint32_t visit_ = 0;                           // of the newest scan
  std::uint64_t epoch_ = 0;                           // of the newest scan, see ComparedPose
  double way_ = 0.0;                                  // m, since the latest key scan
  Eigen::Vector3d latest_ = Eigen::Vector3d::Zero();  // m, sensor of the latest scan
  std::vector<KeyScan> keys_;
  std::vector<const KeyScan*> near_;  // of one visit, the nearest one first
  std::vector<ReturnToPlace> found_;
  GroundSplit kept_;  // static points of the newest key scan
  std::vector<std::uint8_t> bytes_;
  PointBuffer selected_;  // of these
};

}  // namespace dynains
