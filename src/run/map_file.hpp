// The file of a static map, in the format of its name.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "dynains/io/las_file.hpp"
#include "dynains/io/point_file.hpp"
#include "dynains/verdict.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"
#include "scan_range.hpp"
#include "verdict_files.hpp"

namespace dynains::run {

/// Values of a point of a static map that the map itself does not hold.
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

/// For each voxel of the world, the attributes of the first point that was kept in it. Memory grows
/// with the map: some 100 bytes for each voxel.
class MapAttributeTable {
 public:
  /// `voxel`: edge of the voxels of the map, m. `origin`: m, world frame, within 200 km of the map.
  MapAttributeTable(double voxel, const Eigen::Vector3d& origin);

  /// Adds the points that the verdict keeps.
  void add(const JudgedScan& judged);

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

/// Whether the extension is that of a map: .ply, .pcd or .las.
bool is_map_name(const std::filesystem::path& path);
bool is_las(const std::filesystem::path& path);

/// The edge of voxels that hold about one of `points` points of surfaces, m, from `least` on and
/// about `most` at the most. `count(edge)`: number of voxels of this edge that hold points.
template <class Count>
double edge_by_spacing(std::size_t points, double least, double most, Count&& count) {
  double edge = least;
  // Voxels 1.42 times as wide hold twice as many points of a surface.
  while (edge < most && points < 2 * count(1.42 * edge)) edge *= 1.2;
  return edge;
}

/// Options of a LAS file whose origin is a whole number of kilometres near `position` (m, world),
/// so that its coordinates stay short.
LasOptions las_options_near(const Eigen::Vector3d& position);

struct MapFileOptions {
  PointColumns columns;          ///< of .ply and .pcd
  LasOptions las;                ///< of .las
  double intensity_scale = 1.0;  ///< of .las: from the intensities of scans to 16 bits
};

/// Writes points one by one; `commit()` creates the file. All members throw IoError.
class MapFile {
 public:
  static std::unique_ptr<MapFile> open(const std::filesystem::path& path,
                                       const MapFileOptions& options);
  virtual ~MapFile() = default;

  /// `position`: m, world frame.
  virtual void add(const Eigen::Vector3d& position, const MapAttributes& attributes) = 0;
  virtual std::size_t size() const = 0;
  virtual void commit() = 0;
};

/// Opens a file for the map of these scans. `crs`: see LasOptions::wkt. Throws IoError.
std::unique_ptr<MapFile> open_map(const std::filesystem::path& file, const Recording& recording,
                                  const ScanRange& range, bool has_attributes,
                                  const std::string& crs);

/// Columns of the file of moving points of these scans.
PointColumns moving_columns(const Recording& recording, const ScanRange& range);

}  // namespace dynains::run
