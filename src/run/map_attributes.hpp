// Values of the points of a static map that the map itself does not hold.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/verdict.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::program {

struct MapAttributes {
  double scan_time = 0.0;  ///< s
  double time = 0.0;       ///< of the point, as in the recording
  float intensity = 0.0F;
  float belief = 0.0F;
  std::uint32_t label = 0;  ///< of the recording
  std::uint32_t instance = 0;
  std::uint16_t session = 0;  ///< of a map of many sessions
  Cause cause{};
  bool is_ground = false;
};

/// Attributes of point i of a scan with its verdict. `labels` of the recording may be empty.
MapAttributes attributes_of(const RecordedScan& scan, const ScanVerdict& verdict,
                            const std::vector<std::uint32_t>& labels, std::size_t i);

/// For each voxel of the world, the attributes of the first point that was kept in it. Memory grows
/// with the map: some 100 bytes for each voxel.
class MapAttributeTable {
 public:
  /// `voxel`: edge of the voxels of the map, m. `origin`: m, world frame, within 200 km of the map.
  MapAttributeTable(double voxel, const Eigen::Vector3d& origin);

  /// Adds the points of a scan that the verdict keeps.
  void add(const RecordedScan& scan, const ScanVerdict& verdict,
           const std::vector<std::uint32_t>& labels);

  /// Attributes of a point of the map, world frame, by its voxel. Rounding can move a point over a
  /// border, so that a neighbouring voxel counts if its own one is empty.
  MapAttributes at(const Eigen::Vector3d& position) const;

 private:
  VoxelKey key_of(const Eigen::Vector3d& position) const;

  double voxel_;
  Eigen::Vector3d origin_;
  VoxelHashTable<> voxels_;
  std::vector<MapAttributes> attributes_;  // by number of the voxel
};

}  // namespace dynains::program
