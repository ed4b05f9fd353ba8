// The file of a static map, in the format of its name.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <memory>

#include "dynains/io/las_file.hpp"
#include "dynains/io/point_file.hpp"
#include "map_attributes.hpp"

namespace dynains::program {

/// Whether the extension is that of a map: .ply, .pcd or .las.
bool is_map_name(const std::filesystem::path& path);
bool is_las(const std::filesystem::path& path);

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

/// The factor to 16 bits for intensities with this maximum: the full range for [0, 1] and for
/// [0, 255], else 1.
double las_intensity_scale(float most);

}  // namespace dynains::program
