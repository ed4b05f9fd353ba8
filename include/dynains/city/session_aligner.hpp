// Alignment of a session with a map of many sessions whose frame is slightly different.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "dynains/city/city.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// Registers scans of a session to planes and poles through the points of the map. Moving points
/// have little weight (Geman-McClure), so scans need no verdicts. In each tile, the newest three
/// sessions of the map count. The result depends on the scans, the start and these sessions alone.
/// Memory: about 100 MB for kMaxScans scans that lie far apart.
class SessionAligner {
 public:
  /// More scans hardly improve the result.
  static constexpr std::size_t kMaxScans = 40;
  static constexpr double kMaxTranslation = 2.0;  ///< m, at the first scan in the map
  static constexpr double kMaxRotation = 5.0;     ///< deg

  explicit SessionAligner(const City& city) : city_(city) {}

  /// Adds one scan. `points`: m, sensor frame; points that are not finite are ignored.
  void add(PointsView points, const Pose& T_session_sensor);

  /// Refines an estimate that is at most kMaxTranslation and kMaxRotation away. Throws
  /// ConfigError, with the figures, if the map has no points there, or if the scans do not fit, fit
  /// at several places or leave a direction open; IoError.
  SessionAlignment align(const Pose& T_city_start) const;

 private:
  City city_;
  std::vector<Eigen::Vector3d> sensors_;  // m, session frame, by scan
  std::vector<Eigen::Vector3d> points_;   // m, session frame; one for each small voxel
  VoxelHashTable<> taken_;
};

}  // namespace dynains
