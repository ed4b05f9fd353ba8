#include "map_file.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/text.hpp"

namespace dynains::run {
namespace {

class PointMapFile final : public MapFile {
 public:
  PointMapFile(const std::filesystem::path& path, const PointColumns& columns)
      : writer_(path, columns) {}

  void add(const Eigen::Vector3d& position, const MapAttributes& attributes) override {
    FilePoint point;
    point.position = position;
    point.intensity = attributes.intensity;
    point.label = attributes.label;
    point.time = attributes.time;
    point.session = attributes.session;
    writer_.add(point);
  }
  std::size_t size() const override { return writer_.size(); }
  void commit() override { writer_.commit(); }

 private:
  PointFileWriter writer_;
};

class LasMapFile final : public MapFile {
 public:
  LasMapFile(const std::filesystem::path& path, const MapFileOptions& options)
      : writer_(path, options.las), intensity_scale_(options.intensity_scale) {}

  void add(const Eigen::Vector3d& position, const MapAttributes& attributes) override {
    const double intensity = std::round(intensity_scale_ * attributes.intensity);
    LasPoint point;
    point.position = position;
    // NaN is not >= 0 and becomes 0.
    point.intensity = intensity >= 0.0 ? static_cast<std::uint16_t>(std::min(intensity, 65535.0))
                                       : std::uint16_t{0};
    point.classification = attributes.is_ground ? LasClass::kGround : LasClass::kUnclassified;
    point.time = attributes.scan_time;
    point.belief = attributes.belief;
    point.cause = static_cast<std::uint8_t>(attributes.cause);
    point.instance = attributes.instance;
    writer_.add(point);
  }
  std::size_t size() const override { return writer_.size(); }
  void commit() override { writer_.commit(); }

 private:
  LasWriter writer_;
  double intensity_scale_;
};

/// Attributes of point i of a scan.
MapAttributes attributes_of(const JudgedScan& judged, std::size_t i) {
  const RecordedScan& scan = judged.scan;
  const ScanVerdict& verdict = judged.verdict;
  MapAttributes attributes;
  attributes.scan_time = verdict.time;
  if (!scan.time.empty()) attributes.time = scan.time[i];
  attributes.intensity = scan.xyzi[4 * i + 3];
  attributes.belief = verdict.beliefs[i];
  if (!judged.truth.empty()) attributes.label = judged.truth[i];
  attributes.instance = verdict.instances[i];
  attributes.cause = verdict.causes[i];
  attributes.is_ground = verdict.labels[i] == PointLabel::kGround;
  return attributes;
}

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

bool is_las(const std::filesystem::path& path) {
  return text::lower_case(path.extension().string()) == ".las";
}

bool is_map_name(const std::filesystem::path& path) { return is_point_file(path) || is_las(path); }

std::unique_ptr<MapFile> MapFile::open(const std::filesystem::path& path,
                                       const MapFileOptions& options) {
  if (is_las(path)) return std::make_unique<LasMapFile>(path, options);
  return std::make_unique<PointMapFile>(path, options.columns);
}

LasOptions las_options_near(const Eigen::Vector3d& position) {
  constexpr double kKilometre = 1000.0;  // m
  LasOptions options;
  options.offset = kKilometre * (position / kKilometre).array().floor();
  return options;
}

std::unique_ptr<MapFile> open_map(const std::filesystem::path& file, const Recording& recording,
                                  const ScanRange& range, bool has_attributes,
                                  const std::string& crs) {
  MapFileOptions options;
  options.columns.double_xyz = is_far(recording, range);
  if (has_attributes) {
    options.columns.intensity = recording.columns().intensity;
    options.columns.time = recording.columns().time;
    options.columns.label = recording.has_labels();
  }
  if (is_las(file)) {
    options.las = las_options_near(recording.T_world_sensor(range.first).translation());
    options.las.wkt = crs;
    options.intensity_scale = las_intensity_scale(recording.read_scan(range.first));
  }
  return MapFile::open(file, options);
}

PointColumns moving_columns(const Recording& recording, const ScanRange& range) {
  PointColumns columns = recording.columns();
  columns.double_xyz = is_far(recording, range);
  columns.intensity = true;
  columns.label = true;
  return columns;
}

MapAttributeTable::MapAttributeTable(double voxel, const Eigen::Vector3d& origin)
    : voxel_(voxel), origin_((origin / voxel).array().floor()) {}

void MapAttributeTable::add(const JudgedScan& judged) {
  const ScanVerdict& verdict = judged.verdict;
  for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
    if (!is_static(verdict.labels[i])) continue;
    const Eigen::Map<const Eigen::Vector3f> point(judged.scan.xyzi.data() + 4 * i);
    const std::uint32_t voxel =
        voxels_.insert(key_of(verdict.T_world_sensor * point.cast<double>()));
    if (voxel == attributes_.size()) attributes_.push_back(attributes_of(judged, i));
  }
}

MapAttributes MapAttributeTable::at(const Eigen::Vector3d& position) const {
  const VoxelKey key = key_of(position);
  std::uint32_t found = voxels_.find(key);
  for_each_touching(key, [&](VoxelKey near) {
    if (found == kNoIndex) found = voxels_.find(near);
  });
  return found == kNoIndex ? MapAttributes() : attributes_[found];
}

VoxelKey MapAttributeTable::key_of(const Eigen::Vector3d& position) const {
  const Eigen::Vector3d index = (position / voxel_).array().floor() - origin_.array();
  return voxel_key(static_cast<std::int64_t>(index.x()), static_cast<std::int64_t>(index.y()),
                   static_cast<std::int64_t>(index.z()));
}

}  // namespace dynains::run
