// Reader of point clouds in PLY, PCD, LAS, NumPy and text files; writer of PLY, PCD and LAS.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dynains/io/atomic_file.hpp"
#include "dynains/pose.hpp"

namespace dynains {

/// Largest coordinate, m, that a float represents with an error of at most 0.5 mm. Larger
/// coordinates require doubles: UTM coordinates as floats have errors of up to 0.25 m.
inline constexpr double kFloatCoordinateLimit = 1e4;

/// One point to write. Members without a column in the file are ignored; values are written as they
/// are.
struct FilePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  float intensity = 0.0F;
  std::uint32_t label = 0;
  std::uint16_t ring = 0;
  double time = 0.0;
  std::uint16_t session = 0;
  // The fields below are written to LAS files only.
  double scan_time = 0.0;      ///< s, in the field of the time of GPS
  bool is_ground = false;      ///< class 2 of ASPRS; others are of class 1
  float belief = 0.0F;         ///< extra bytes `belief`: probability of being dynamic, [0, 1]
  std::uint8_t cause = 0;      ///< extra bytes `cause`: see Cause
  std::uint32_t instance = 0;  ///< extra bytes `instance`: 0 for none
};

/// Columns of PLY and PCD in addition to x y z.
struct PointColumns {
  bool double_xyz = false;  ///< x y z as double; some PCD readers support floats only
  bool intensity = false;   ///< float `intensity`
  bool label = false;       ///< uint32 `label`
  bool ring = false;        ///< uint16 `ring`
  bool time = false;        ///< double `time`
  bool session = false;     ///< uint16 `session`, of a map of many sessions
};

struct LasOptions {
  /// Origin of the integer coordinates, m. Points are within 2,147 km of it.
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  std::string wkt;               ///< coordinate reference system (OGC 01-009); empty: none
  double intensity_scale = 1.0;  ///< from intensities to 16 bits, at which they are cut
};

/// Writes a binary point file, point by point, with few points in memory. The number of points need
/// not be known in advance. `commit()` creates or replaces the file atomically.
class PointFileWriter {
 public:
  /// The extension determines the format: .ply, .pcd, or .las (1.4, point format 6, steps of 1 mm).
  /// `viewpoint`: pose of the sensor for the header of PCD. Throws IoError for another extension, a
  /// folder that is not writable, or a reference system of 65,535 bytes or more.
  explicit PointFileWriter(const std::filesystem::path& path, const PointColumns& columns = {},
                           const Pose& viewpoint = Pose::Identity(), const LasOptions& las = {});

  /// Adds one point. commit() reports failures. Throws IoError for a position that LAS cannot hold.
  void add(const FilePoint& point);
  std::size_t size() const { return size_; }
  /// Puts the file in place. Throws IoError unless it was written completely.
  void commit(AtomicFile::Sync sync = AtomicFile::Sync::kNow);

 private:
  std::string header() const;
  void write_buffer();

  std::filesystem::path path_;
  PointColumns columns_;
  Pose viewpoint_;
  bool is_las_;
  LasOptions las_;
  std::array<std::int32_t, 3> least_, most_;  ///< of the coordinates of LAS, mm
  std::size_t size_ = 0;
  std::string buffer_;  ///< bytes of points that are not in the file yet
  AtomicFile file_;
};

/// Whether PointFileWriter writes files with this extension.
bool is_point_file(const std::filesystem::path& path);
/// Whether the extension is .las.
bool is_las(const std::filesystem::path& path);

/// For a known format that is not read (.laz, .e57, .pcap, a dump of GLIM): its name and the way to
/// convert it. Else empty.
std::optional<std::string> conversion_of(const std::filesystem::path& path);

/// Content of a point file. Each column has one value per position, or is empty if the file lacks
/// it. The accepted column names are listed; their case is ignored. Values keep the units of the
/// file.
struct PointFile {
  std::vector<Eigen::Vector3d> positions;  ///< x y z
  std::vector<float> intensity;            ///< intensity, i, reflectivity, scalar_intensity
  std::vector<std::uint16_t> ring;         ///< ring, channel, line, scalar_ring
  std::vector<double> time;                ///< time, t, timestamp, offset_time, scalar_time
  std::vector<std::uint32_t> label;        ///< label, class, scalar_label
  /// sensor, lidar_id, lidar_index, d, laser_number; 255 for values that are no numbers of sensors
  std::vector<std::uint8_t> sensor;
  /// Pose of the sensor: VIEWPOINT of PCD, else identity.
  Pose viewpoint = Pose::Identity();
};

/// Reads a point file. The extension determines the format:
///
///   .ply        ascii, binary of both byte orders
///   .pcd        ascii, binary, binary_compressed
///   .las        version 1.0 to 1.4, point formats 0 to 10; the time of GPS is `time`; `ring` and
///               `label` are extra bytes
///   .npy        a structured array with fields of these names, or one row for each point: x y z
///               intensity, others ignored
///   .xyz, .csv  text with a point on each line, separated by blanks, commas or semicolons: x y z
///               intensity, others ignored; or with names of the columns in the first line
///
/// Throws IoError with path, line or byte, and expected content.
PointFile read_points(const std::filesystem::path& path);

/// Header of a point file.
struct PointFileHeader {
  Pose viewpoint = Pose::Identity();  ///< as in PointFile
  PointColumns columns;               ///< without double_xyz
  std::uint64_t point_count = 0;
};
/// Reads the header of a point file, but no points; lines of a text are counted. Throws IoError
/// like read_points(), also unless the file is large enough for its points.
PointFileHeader read_point_file_header(const std::filesystem::path& path);

}  // namespace dynains
