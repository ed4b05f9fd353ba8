#include "dynains/io/recording.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "byte_reader.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/kitti.hpp"
#include "dynains/io/point_file.hpp"
#include "failure.hpp"
#include "points/bin_layout.hpp"
#include "points/finite_points.hpp"
#include "points/point_clock.hpp"
#include "scan_reader.hpp"
#include "text.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

/// Points of the own vehicle become beams without a return.
void clear_boxes(const std::vector<Eigen::AlignedBox3d>& boxes, RecordedScan& scan) {
  for_each_position(scan, [&](auto p) {
    const Eigen::Vector3d at = p.template cast<double>();
    const auto holds = [&](const Eigen::AlignedBox3d& box) { return box.contains(at); };
    if (std::any_of(boxes.begin(), boxes.end(), holds)) p.setZero();
  });
}

fs::path label_file(const fs::path& folder, const std::string& scan) {
  return folder / "labels" / (scan + ".label");
}

/// Classes of SemanticKITTI for intensities 0 and 1: another object, another vehicle that moves.
std::vector<std::uint32_t> labels_of_intensity(const RecordedScan& scan) {
  std::vector<std::uint32_t> labels;
  for (std::size_t k = 3; k < scan.xyzi.size(); k += 4) {
    labels.push_back(scan.xyzi[k] > 0.0F ? 259U : 99U);
  }
  return labels;
}

/// T_world_sensor at `time`, by the poses around it or by the two nearest ones.
std::optional<Pose> motion_at(const Trajectory& motion, double time) {
  const std::vector<double>& times = motion.times;
  if (times.size() < 2) return std::nullopt;
  const auto after = std::upper_bound(times.begin() + 1, times.end() - 1, time);
  const auto k = static_cast<std::size_t>(after - times.begin());
  const auto along = [&](std::size_t end) -> std::optional<Pose> {
    const double gap = times[end] - times[end - 1];
    const double beyond = std::max(times[end - 1] - time, time - times[end]);
    if (gap > kMaxPoseGap || beyond > kMaxScan) return std::nullopt;
    const double share = (time - times[end - 1]) / gap;
    return extrapolate(motion.poses[end - 1], motion.poses[end], share);
  };
  for (const std::size_t end : {k, k - 1, k + 1}) {
    if (end < 1 || end >= times.size()) continue;
    if (const auto pose = along(end)) return pose;
  }
  return std::nullopt;
}

/// Transforms from the sensor frame at a time to that at the stamp, at equal steps of time. The
/// nearest one is off by at most half a step: 1.5 mm at 30 m/s in a scan of 0.1 s.
class Motion {
 public:
  Motion(const Trajectory& motion, double stamp, const Pose& T_world_sensor, double first,
         double last, const std::filesystem::path& place)
      : first_(first), step_((last - first) / kSteps) {
    const Pose T_stamp_world = T_world_sensor.inverse();
    for (std::size_t i = 0; i <= (step_ > 0.0 ? kSteps : 0); ++i) {
      const double offset = first + static_cast<double>(i) * step_;
      const auto pose = motion_at(motion, stamp + offset);
      if (!pose) {
        fail(place,
             "the scan cannot be de-skewed: expected poses at most 1 s apart around its points");
      }
      T_stamp_sensor_.push_back(T_stamp_world * *pose);
    }
  }

  const Pose& at(double offset) const {
    if (T_stamp_sensor_.size() == 1) return T_stamp_sensor_.front();
    const double index = std::round((offset - first_) / step_);
    return T_stamp_sensor_[static_cast<std::size_t>(std::clamp(index, 0.0, double{kSteps}))];
  }

 private:
  static constexpr std::size_t kSteps = 1000;

  double first_;
  double step_;
  std::vector<Pose> T_stamp_sensor_;
};

/// Moves the points of a scan to the sensor frame at its `stamp`, s, by `motion`: T_world_sensor
/// with times, which is continued with constant velocity by at most kMaxScan. Points at the origin
/// and those whose time cannot be that of the scan (see times_of_scan()) keep their place. Throws
/// IoError that begins with `place`.
void deskew(const Trajectory& motion, double stamp, const Pose& T_world_sensor,
            const PointClock& clock, const std::filesystem::path& place, RecordedScan& scan) {
  if (scan.time.size() != scan.size()) {
    fail(place, "the scan cannot be de-skewed: expected a column time");
  }
  const PointTimes times = times_of_scan(scan, clock);
  if (times.is_empty()) return;
  const double first = clock.after(stamp, times.first);
  const double last = clock.after(stamp, times.last);
  if (std::max(std::abs(first), std::abs(last)) > kMaxScan) {
    fail(place,
         "the scan cannot be de-skewed: expected times of points within 1 s of the time of the "
         "scan, " +
             text::to_text(stamp) + " s; found " + text::to_text(times.first) + " to " +
             text::to_text(times.last) + ", which is in s " +
             text::to_text(clock.unit * times.first) + " to " +
             text::to_text(clock.unit * times.last) + (clock.is_absolute ? "" : " after it"));
  }
  const Motion T_stamp_sensor(motion, stamp, T_world_sensor, first, last, place);
  for (std::size_t k = 0; k < scan.size(); ++k) {
    Eigen::Map<Eigen::Vector3f> p(scan.xyzi.data() + 4 * k);
    if (!times.holds(scan.time[k]) || p.isZero(0.0F)) continue;
    p = (T_stamp_sensor.at(clock.after(stamp, scan.time[k])) * p.cast<double>()).cast<float>();
  }
}

/// .bin: float32 x y z intensity, or other columns; .pcd.bin of nuScenes has a ring behind them.
class BinReader final : public ScanReader {
 public:
  BinReader(const BinLayout& layout, bool has_ring) : layout_(layout), has_ring_(has_ring) {}

  PointColumns columns(const ScanEntry&) const override {
    PointColumns columns;
    columns.intensity = layout_.columns > 3;
    columns.ring = has_ring_;
    return columns;
  }
  std::uint64_t point_count(const ScanEntry& scan) const override {
    return count_bin_points(scan.file, layout_);
  }
  void read(const ScanEntry& scan, const FileTransform* T_target_file,
            RecordedScan& points) const override {
    points.ring.clear();
    points.time.clear();
    points.sensor.clear();
    is_usual(layout_)
        ? dynains::read_scan(scan.file, points.xyzi)
        : read_bin_points(scan.file, layout_, points.xyzi, has_ring_ ? &points.ring : nullptr);
    transform_scan(T_target_file, points);
  }
  std::vector<std::uint32_t> read_labels(const ScanEntry& scan) const override {
    fail(scan.file, "has no labels");
  }

 private:
  BinLayout layout_;
  bool has_ring_;
};

/// Files of read_points().
class PointFileReader final : public ScanReader {
 public:
  PointColumns columns(const ScanEntry& scan) const override {
    return read_point_file_header(scan.file).columns;
  }
  std::uint64_t point_count(const ScanEntry& scan) const override {
    return read_point_file_header(scan.file).point_count;
  }
  void read(const ScanEntry& scan, const FileTransform* T_target_file,
            RecordedScan& points) const override {
    PointFile file = read_points(scan.file);
    points.xyzi.resize(4 * file.positions.size());
    for (std::size_t k = 0; k < file.positions.size(); ++k) {
      Eigen::Vector3d p = file.positions[k];
      if (T_target_file != nullptr) p = *T_target_file * p;
      float* xyzi = points.xyzi.data() + 4 * k;
      Eigen::Map<Eigen::Vector3f>(xyzi, 3) = p.cast<float>();
      xyzi[3] = file.intensity.empty() ? 0.0F : file.intensity[k];
    }
    points.ring = std::move(file.ring);
    points.time = std::move(file.time);
    points.sensor = std::move(file.sensor);
  }
  std::vector<std::uint32_t> read_labels(const ScanEntry& scan) const override {
    PointFile points = read_points(scan.file);
    if (points.label.size() != points.positions.size()) {
      fail(scan.file, "expected a column \"label\", as in the first scan");
    }
    return std::move(points.label);
  }
};

/// From the coordinates of a file to the sensor frame, m; nothing if they are the same.
std::optional<FileTransform> T_sensor_file(const RecordingContents& r, const ScanEntry& scan) {
  const bool is_in_world = r.frame == PointFrame::kWorld;
  if (!is_in_world && r.options.point_unit == 1.0) return std::nullopt;
  FileTransform T = FileTransform::Identity();
  if (is_in_world) T = scan.T_world_sensor.inverse();
  if (r.options.point_unit != 1.0) T.scale(r.options.point_unit);
  return T;
}

/// Numbers of the sensors in a file beside the scans take the place of those of the scan.
void read_sensors(const RecordingContents& r, const std::string& name, RecordedScan& scan) {
  if (r.options.sensors.empty()) {
    scan.sensor.clear();
    return;
  }
  const fs::path file = r.folder / "sensor" / (name + ".id");
  if (is_file(file)) scan.sensor = read_point_bytes(file, scan.size());
  if (r.options.sensor_beams > 0) {
    for (std::uint8_t& sensor : scan.sensor) {
      sensor = static_cast<std::uint8_t>(sensor / r.options.sensor_beams);
    }
  }
}

}  // namespace

void transform_scan(const FileTransform* T_target_file, RecordedScan& points) {
  if (T_target_file == nullptr) return;
  for_each_position(points, [&](auto p) {
    p = (*T_target_file * p.template cast<double>()).template cast<float>();
  });
}

std::unique_ptr<ScanReader> make_file_reader(ScanFormat format, const BinLayout& layout) {
  constexpr BinLayout kNuScenes{5, false};
  if (format == ScanFormat::kBin) return std::make_unique<BinReader>(layout, false);
  if (format == ScanFormat::kNuScenes) return std::make_unique<BinReader>(kNuScenes, true);
  return std::make_unique<PointFileReader>();
}

std::vector<Eigen::AlignedBox3d> parse_self_boxes(const std::string& text) {
  const std::vector<double> numbers = text::numbers_in(text, ",;").value_or(std::vector<double>());
  const bool are_finite = std::all_of(numbers.begin(), numbers.end(),
                                      [](double number) { return std::isfinite(number); });
  if (!are_finite || numbers.empty() || numbers.size() % 6 != 0) {
    throw ConfigError("self-box \"" + text +
                      "\": expected six finite numbers for each box, \"x y z x y z\", two opposite "
                      "corners in m");
  }
  std::vector<Eigen::AlignedBox3d> boxes;
  for (std::size_t i = 0; i < numbers.size(); i += 6) {
    Eigen::AlignedBox3d box(Eigen::Vector3d::Map(numbers.data() + i));
    boxes.push_back(box.extend(Eigen::Vector3d::Map(numbers.data() + i + 3)));
  }
  return boxes;
}

Recording::Recording(const fs::path& path, const RecordingOptions& options)
    : reader_(open_recording(path, options, contents_)) {}

std::vector<fs::path> Recording::files() const {
  std::vector<fs::path> files = contents_.files;
  files.insert(files.end(), contents_.options.sources.begin(), contents_.options.sources.end());
  if (contents_.labels != LabelSource::kFiles) return files;
  for (const ScanEntry& scan : contents_.scans)
    files.push_back(label_file(contents_.folder, scan.name));
  return files;
}

const LogScans* Recording::log() const { return reader_->log_scans(); }

std::uint64_t Recording::point_count(std::size_t i) const {
  return reader_->point_count(contents_.scans.at(i));
}

void Recording::read_scan(std::size_t i, RecordedScan& scan) const {
  const ScanEntry& entry = contents_.scans.at(i);
  const std::optional<FileTransform> T = T_sensor_file(contents_, entry);
  reader_->read(entry, T ? &*T : nullptr, scan);
  if (contents_.frame == PointFrame::kSensor && !sensor_origin().isZero(0.0)) {
    const Eigen::Vector3f origin = sensor_origin().cast<float>();
    for_each_position(scan, [&](auto p) {
      if (!p.isZero(0.0F)) p -= origin;  // beams without a return stay at the origin
    });
  }
  read_sensors(contents_, entry.name, scan);
  if (!contents_.options.self_boxes.empty()) clear_boxes(contents_.options.self_boxes, scan);
  if (contents_.clock && !contents_.motion.poses.empty())
    deskew(contents_.motion, time(i), T_world_sensor(i), *contents_.clock, file(i), scan);
}

RecordedScan Recording::read_scan(std::size_t i) const {
  RecordedScan scan;
  read_scan(i, scan);
  return scan;
}

bool Recording::has_labels(std::size_t i) const {
  return contents_.labels == LabelSource::kFiles ? fs::exists(label_file(contents_.folder, name(i)))
                                                 : has_labels();
}

std::vector<std::uint32_t> Recording::read_labels(std::size_t i) const {
  if (contents_.labels == LabelSource::kIntensity) return labels_of_intensity(read_scan(i));
  if (contents_.labels != LabelSource::kFiles) return reader_->read_labels(contents_.scans.at(i));
  return dynains::read_labels(label_file(contents_.folder, name(i)), point_count(i));
}

std::vector<double> Recording::point_offsets(std::size_t i, const RecordedScan& scan) const {
  std::vector<double> offsets;
  if (!contents_.clock || scan.time.size() != scan.size()) return offsets;
  const PointTimes times = times_of_scan(scan, *contents_.clock);
  for (const double point_time : scan.time) {
    offsets.push_back(times.holds(point_time) ? contents_.clock->after(time(i), point_time)
                                              : std::numeric_limits<double>::quiet_NaN());
  }
  return offsets;
}

}  // namespace dynains
