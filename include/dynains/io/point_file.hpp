// Point clouds in PLY and PCD files.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "dynains/io/atomic_file.hpp"

namespace dynains {

/// Distance from the origin, m, up to which a float coordinate is exact to 0.5 mm. Beyond it, write
/// doubles: UTM coordinates as floats are off by up to 0.25 m.
inline constexpr double kFloatCoordinateLimit = 1e4;

/// One point to write. Members without a column in the file are ignored.
struct FilePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  float intensity = 0.0F;
  std::array<std::uint8_t, 3> rgb{};
  std::uint32_t label = 0;
  std::uint16_t ring = 0;
  double time = 0.0;
};

/// Columns in addition to x y z.
struct PointColumns {
  bool double_xyz = false;  ///< x y z as double; some PCD readers accept floats only
  bool intensity = false;   ///< float `intensity`
  bool rgb = false;         ///< PLY: uchar `red` `green` `blue`; PCD: packed `rgb`
  bool label = false;       ///< uint32 `label`
  bool ring = false;        ///< uint16 `ring`
  bool time = false;        ///< double `time`
};

/// Writes a binary point file, point by point. Keeps no points in memory, and need not know their
/// number in advance. The file appears whole, at `commit()`, or not at all.
class PointFileWriter {
 public:
  /// The format follows from the extension, .ply or .pcd.
  /// `viewpoint` is written to the header of PCD; PLY has no field for it.
  /// Throws IoError for another extension, or if the folder cannot be written.
  explicit PointFileWriter(const std::filesystem::path& path, const PointColumns& columns = {},
                           const Eigen::Isometry3d& viewpoint = Eigen::Isometry3d::Identity());

  void add(const FilePoint& point);
  std::size_t size() const { return size_; }
  /// Throws IoError unless all bytes were written.
  void commit(AtomicFile::Sync sync = AtomicFile::Sync::kNow);

 private:
  std::string header() const;

  PointColumns columns_;
  Eigen::Isometry3d viewpoint_;
  bool pcd_;
  std::size_t size_ = 0;
  AtomicFile file_;
};

/// Whether the extension is .ply or .pcd.
bool is_point_file(const std::filesystem::path& path);

/// Contents of a point file. A column that is not in the file is empty; other columns have one
/// value for each position. The case of names is ignored; units are those of the file.
struct PointFile {
  std::vector<Eigen::Vector3d> positions;  ///< x y z
  std::vector<float> intensity;            ///< intensity, i, reflectivity, scalar_intensity
  std::vector<std::uint16_t> ring;         ///< ring, channel, line, scalar_ring
  std::vector<double> time;                ///< time, t, timestamp, offset_time, scalar_time
  std::vector<std::uint32_t> label;        ///< label, class, scalar_label
  /// Pose of the sensor: VIEWPOINT of PCD, else identity.
  Eigen::Isometry3d viewpoint = Eigen::Isometry3d::Identity();
};

/// Reads PLY (ascii, binary of both byte orders) and PCD (ascii, binary, binary_compressed); the
/// format follows from the extension. Throws IoError with path, line or byte, and expectation.
PointFile read_points(const std::filesystem::path& path);

/// Header of a point file.
struct PointFileHeader {
  Eigen::Isometry3d viewpoint = Eigen::Isometry3d::Identity();  ///< as in PointFile
  PointColumns columns;                                         ///< without rgb and double_xyz
  std::uint64_t point_count = 0;  ///< as stated; check_point_file() compares it with the file size
};
PointFileHeader read_point_file_header(const std::filesystem::path& path);

/// Throws IoError unless the header is valid and the file is large enough for its points. Points
/// are not read.
void check_point_file(const std::filesystem::path& path);

}  // namespace dynains
