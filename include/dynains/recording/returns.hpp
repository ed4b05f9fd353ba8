// Places that a trajectory comes back to, and how well the scans fit there.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "dynains/ground/ground_split.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/byte_store.hpp"
#include "dynains/registration/alignment_points.hpp"
#include "dynains/registration/plane_aligner.hpp"
#include "dynains/registration/voxel_planes.hpp"

namespace dynains {

/// A scan near earlier ones, and what an alignment with their planes tells.
struct ReturnToPlace {
  std::uint32_t earlier, later;  ///< numbers of scans, the nearest earlier one
  double inliers = 0.0;          ///< share of the points in voxels with a plane
  double movement = 0.0;         ///< m, of points 10 m away to where they fit best
  double deviation = 0.0;        ///< m, of that movement along its least certain direction
};

/// Aligns a scan each 5 m of way with scans near it that are old enough.
class Returns {
 public:
  /// Points of the scans wait in `store`, which outlives this. `compared`: scans; younger ones were
  /// compared before.
  Returns(ByteStore& store, std::uint32_t compared) : store_(store), compared_(compared) {}

  /// Takes the next scan. Returns the place that it comes back to, if any. `points`: m, sensor
  /// frame, with their verdicts. Scans before `first` do not count. Throws what the store throws.
  std::optional<ReturnToPlace> add(PointsView points, Span<const PointLabel> verdicts,
                                   const Pose& T_world_sensor, std::uint32_t first);

 private:
  struct KeyScan {
    std::uint32_t scan;
    Pose T_world_sensor;
    std::uint64_t offset;  // in the store
    std::size_t size;      // bytes
  };

  void keep(PointsView points, Span<const PointLabel> verdicts);
  void add_planes(const KeyScan& key, const Pose& T_origin_world);
  ReturnToPlace aligned(const KeyScan& nearest, const Pose& T_world_sensor);

  ByteStore& store_;
  std::uint32_t compared_;
  std::uint32_t scans_ = 0;
  double way_ = 0.0;                                  // m, since the latest key scan
  Eigen::Vector3d latest_ = Eigen::Vector3d::Zero();  // m, sensor of the latest scan
  std::vector<KeyScan> keys_;
  std::vector<const KeyScan*> near_;
  GroundSplit kept_;  // points of the newest key scan that stand
  std::vector<std::uint8_t> bytes_;
  detail::VoxelPlanes planes_;  // in the frame of the nearest scan
};

}  // namespace dynains
