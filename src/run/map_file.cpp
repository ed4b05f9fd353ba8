#include "map_file.hpp"

#include <algorithm>
#include <limits>

namespace dynains::run {
namespace {

/// Points lie around the poses; near the limit doubles cost little and lose nothing.
bool is_far(const Recording& recording, const ScanRange& range) {
  // No sensor reaches farther than 500 m.
  for (std::size_t i = range.first; i <= range.last; ++i) {
    const Eigen::Vector3d position = recording.T_world_sensor(i).translation();
    if (position.cwiseAbs().maxCoeff() > kFloatCoordinateLimit - 500.0) return true;
  }
  return false;
}

/// The factor to 16 bits for the intensities of a scan: the full range for [0, 1] and for [0, 255],
/// else 1.
double las_intensity_scale(const RecordedScan& scan) {
  float most = 0.0F;
  for (std::size_t i = 0; i < scan.size(); ++i) most = std::max(most, scan.xyzi[4 * i + 3]);
  if (!(most > 0.0F && most <= 255.0F)) return 1.0;
  return std::numeric_limits<std::uint16_t>::max() / (most <= 1.0F ? 1.0 : 255.0);
}

}  // namespace

LasOptions las_options_near(const Eigen::Vector3d& position) {
  constexpr double kKilometre = 1000.0;  // m
  LasOptions options;
  options.offset = kKilometre * (position / kKilometre).array().floor();
  return options;
}

PointColumns map_columns(const Recording& recording, const ScanRange& range, bool has_attributes) {
  PointColumns columns;
  columns.double_xyz = is_far(recording, range);
  if (has_attributes) {
    columns.intensity = recording.columns().intensity;
    columns.time = recording.columns().time;
    columns.label = recording.has_labels();
  }
  return columns;
}

std::unique_ptr<PointFileWriter> open_map(const std::filesystem::path& file,
                                          const Recording& recording, const ScanRange& range,
                                          bool has_attributes, const std::string& crs) {
  LasOptions las;
  if (is_las(file)) {
    las = las_options_near(recording.T_world_sensor(range.first).translation());
    las.wkt = crs;
    las.intensity_scale = las_intensity_scale(recording.read_scan(range.first));
  }
  return std::make_unique<PointFileWriter>(file, map_columns(recording, range, has_attributes),
                                           Pose::Identity(), las);
}

std::size_t write_points(const OutputFile& output, const PointColumns& columns,
                         const LasOptions& las, const std::function<void(const AddPoint&)>& fill) {
  PointFileWriter writer(output.path(), columns, Pose::Identity(), las);
  fill([&](const FilePoint& point) { writer.add(point); });
  writer.commit();
  return writer.size();
}

PointColumns moving_columns(const Recording& recording, const ScanRange& range) {
  PointColumns columns = recording.columns();
  columns.double_xyz = is_far(recording, range);
  columns.intensity = true;
  columns.label = true;
  return columns;
}

}  // namespace dynains::run
