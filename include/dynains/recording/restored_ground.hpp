// Ground that the first pass removed with what stood or moved on it.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/ground.hpp"
#include "dynains/recording/verdict_arrays.hpp"
#include "dynains/recording/world_cells.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// Gives removed points back to the ground if they are not above the ground of the whole recording.
/// Points beside removed ones that rise above it stay removed: feet and tyres.
class RestoredGround {
 public:
  /// See RecordingGround.
  RestoredGround(ByteStore& store, std::size_t budget) : ground_(store, budget) {}

  /// Takes the ground of a scan.
  void add(PointsView points, Span<const PointLabel> verdicts, const Pose& T_world_sensor) {
    ground_.add(points, verdicts, T_world_sensor);
  }
  /// Ends the scans. All functions below come after it.
  void complete() { ground_.complete(); }
  /// Calls `visit(i, cell)` for the points (m, sensor frame) of which `is_taken(i)` that are 10 cm
  /// or more above the ground of the recording, or more than 30 cm above that around them: a tyre,
  /// a bumper or a bonnet that a scan took for ground.
  template <class IsTaken, class Visitor>
  void for_each_rising(PointsView points, const Pose& T_world_sensor, IsTaken&& is_taken,
                       Visitor&& visit) {
    // m, more than a pose that is off by 0.1 deg moves ground 50 m away
    constexpr double kRise = 0.10;
    constexpr double kBonnet = 0.3;  // m, above the ground around, more than a kerb
    for_each_located(points, T_world_sensor, is_taken, [&](const LocatedPoints& located) {
      ground_.for_each_rise(located, [&](std::size_t k, const WorldCell& cell, const Rise& rise) {
        if (rise.of_cell >= kRise || rise.around > kBonnet) {
          visit(located.point(k), cell);
        }
      });
    });
  }
  /// Restores points of a scan. Returns their number.
  std::size_t restore(PointsView points, const Pose& T_world_sensor, VerdictArrays& verdict);

 private:
  using Rise = RecordingGround::Rise;
  struct Removed {
    std::size_t point;
    Eigen::Vector3d at;  // m, world frame
  };

  void find_removed(PointsView points, const Pose& T_world_sensor, const VerdictArrays& verdict);
  bool is_beside_foot(const Eigen::Vector3d& at) const;

  RecordingGround ground_;
  std::vector<Removed> removed_;  // that do not rise above the ground
  VoxelHashTable<> feet_;         // columns with removed points little above the ground
};

}  // namespace dynains
