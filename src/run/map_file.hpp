// The file of a static map, and the attributes of its points.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dynains/io/point_file.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"
#include "run/output/output_folder.hpp"
#include "scan_range.hpp"
#include "verdict_files.hpp"

namespace dynains::run {

/// For each voxel of the world, the attributes of the first point that was kept in it. Memory grows
/// with the map: some 100 bytes for each voxel.
class MapAttributeTable {
 public:
  /// `voxel`: edge of the voxels of the map, m. `origin`: m, world frame, within 200 km of the map.
  MapAttributeTable(double voxel, const Eigen::Vector3d& origin)
      : voxel_(voxel), origin_((origin / voxel).array().floor()) {}

  /// Adds the points that the verdict keeps.
  void add(const JudgedScan& judged) {
    const ScanVerdict& verdict = judged.verdict;
    for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
      if (!is_static(verdict.labels[i])) continue;
      const Eigen::Map<const Eigen::Vector3f> point(judged.scan.xyzi.data() + 4 * i);
      const std::uint32_t voxel =
          voxels_.insert(key_of(verdict.T_world_sensor * point.cast<double>()));
      if (voxel == attributes_.size()) attributes_.push_back(attributes_of(judged, i));
    }
  }

  /// A point of the map, world frame, with the attributes of its voxel. Rounding can move a point
  /// over a border, so that a neighbouring voxel counts if its own one is empty.
  FilePoint at(const Eigen::Vector3d& position) const {
    const VoxelKey key = key_of(position);
    std::uint32_t found = voxels_.find(key);
    for_each_touching(key, [&](VoxelKey near) {
      if (found == kNoIndex) found = voxels_.find(near);
    });
    FilePoint point = found == kNoIndex ? FilePoint() : attributes_[found];
    point.position = position;
    return point;
  }

 private:
  /// Point i of a scan, but for its position.
  static FilePoint attributes_of(const JudgedScan& judged, std::size_t i) {
    const ScanVerdict& verdict = judged.verdict;
    FilePoint point = judged.scan.point(i);
    point.scan_time = verdict.time;
    point.belief = verdict.beliefs[i];
    if (!judged.truth.empty()) point.label = judged.truth[i];
    point.instance = verdict.instances[i];
    point.cause = static_cast<std::uint8_t>(verdict.causes[i]);
    point.is_ground = verdict.labels[i] == PointLabel::kGround;
    return point;
  }

  VoxelKey key_of(const Eigen::Vector3d& position) const {
    const Eigen::Vector3d index = (position / voxel_).array().floor() - origin_.array();
    return voxel_key(static_cast<std::int64_t>(index.x()), static_cast<std::int64_t>(index.y()),
                     static_cast<std::int64_t>(index.z()));
  }

  double voxel_;
  Eigen::Vector3d origin_;
  VoxelHashTable<> voxels_;
  std::vector<FilePoint> attributes_;  // by number of the voxel
};

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

/// Columns of the map of these scans.
PointColumns map_columns(const Recording& recording, const ScanRange& range, bool has_attributes);

/// Opens a file for the map of these scans. `crs`: see LasOptions::wkt. Throws IoError.
std::unique_ptr<PointFileWriter> open_map(const std::filesystem::path& file,
                                          const Recording& recording, const ScanRange& range,
                                          bool has_attributes, const std::string& crs);

using AddPoint = std::function<void(const FilePoint&)>;
/// Writes the points that `fill(add)` adds to the file of an output, which is not put in place.
/// Returns their number. Throws IoError.
std::size_t write_points(const OutputFile& output, const PointColumns& columns,
                         const LasOptions& las, const std::function<void(const AddPoint&)>& fill);

/// Columns of the file of moving points of these scans.
PointColumns moving_columns(const Recording& recording, const ScanRange& range);

}  // namespace dynains::run
