// Where the scans of a recording lie in a map that was made with other poses.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"

namespace dynains::program {

/// Aligns a scan each 2 m of way with the surfaces of the map around it. The scans up to the next
/// one are moved with it. Where the alignment is uncertain, the motion before it stays.
class MapAlignment {
 public:
  /// `map`: positions in the frame of the map, m; those that are not finite do not count.
  explicit MapAlignment(const std::vector<Eigen::Vector3d>& map);

  /// Whether the next scan is 2 m or more from the latest one that align() took.
  bool is_due(const Pose& T_world_sensor) const;
  /// `standing`: m, sensor frame, points that do not move. The frame of the map has to be that of
  /// the poses but for about a metre and a few degrees.
  void align(PointsView standing, const Pose& T_world_sensor);

  /// From the frame of the poses, at the latest certain alignment.
  const Pose& T_map_world() const { return T_map_world_; }
  std::size_t aligned() const { return aligned_; }  ///< scans whose alignment was certain
  double farthest() const { return farthest_; }     ///< m, most that a sensor was moved

 private:
  PointBuffer around(const Eigen::Vector3d& centre) const;

  std::vector<Eigen::Vector3d> map_;  // by x
  Pose T_map_world_ = Pose::Identity();
  std::optional<Eigen::Vector3d> latest_;  // m, sensor of the latest scan that align() took
  std::size_t aligned_ = 0;
  double farthest_ = 0.0;
};

}  // namespace dynains::program
