#include "dynains/io/recording.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <map>
#include <sstream>
#include <string_view>
#include <utility>

#include "byte_reader.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/kitti.hpp"
#include "dynains/io/point_file.hpp"
#include "dynains/median.hpp"
#include "failure.hpp"
#include "input_file.hpp"
#include "logs/log_scans.hpp"
#include "nuscenes.hpp"
#include "points/bin_layout.hpp"
#include "points/deskew.hpp"
#include "points/point_clock.hpp"
#include "scan_files.hpp"
#include "scan_reader.hpp"
#include "text.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxSensor = 1000.0;  // m, as of RemoverConfig::sensors
constexpr const char* kSensorPoses = "sensors.txt";
constexpr const char* kSensorFolder = "sensor";

constexpr const char* kAccepted =
    "expected a KITTI folder (velodyne/NNNNNN.bin, poses.txt), or a folder of .pcd, .ply, .bin, "
    ".las, .npy, .xyz or .csv scans (or with them in pcd/, ply/, scans/, points/, clouds/ or "
    "lidar/), or a log of ROS (.mcap, .db3, .bag, or a folder with metadata.yaml)";

/// Beams without a return stay at the origin.
void subtract_origin(const Eigen::Vector3f& origin, RecordedScan& scan) {
  for (std::size_t i = 0; i < scan.size(); ++i) {
    Eigen::Map<Eigen::Vector3f> p(scan.xyzi.data() + 4 * i);
    if (!p.isZero(0.0F)) p -= origin;
  }
}

/// Points of the own vehicle become beams without a return.
void clear_boxes(const std::vector<Eigen::AlignedBox3d>& boxes, RecordedScan& scan) {
  for (std::size_t i = 0; i < scan.size(); ++i) {
    Eigen::Map<Eigen::Vector3f> p(scan.xyzi.data() + 4 * i);
    const auto holds = [&](const Eigen::AlignedBox3d& box) {
      return box.contains(p.cast<double>());
    };
    if (std::any_of(boxes.begin(), boxes.end(), holds)) p.setZero();
  }
}

/// Throws ConfigError for options that a recording of this format does not use.
void refuse_idle(const RecordingOptions& o, ScanFormat format, const PointColumns& columns) {
  const auto refuse_if = [](bool is_idle, const char* text) {
    if (is_idle) throw ConfigError(text);
  };
  const bool has_topic = !(o.cloud_topic + o.cloud_frame + o.pose_topic + o.pose_frame).empty();
  refuse_if(format != ScanFormat::kLog && (has_topic || !o.sensor_frame.empty()),
            "--cloud-topic, --frame-id, --pose-topic, --pose-frame-id and --sensor-frame are for "
            "logs of ROS");
  refuse_if(format != ScanFormat::kNuScenes && !o.scene.empty(),
            "--nuscenes-scene is for nuScenes");
  refuse_if(!columns.time && o.point_time_unit > 0.0,
            "--point-time-unit is for points with times; these have none");
}

fs::path label_file(const fs::path& folder, const std::string& scan) {
  return folder / "labels" / (scan + ".label");
}

/// Classes of SemanticKITTI for intensities 0 and 1.
std::vector<std::uint32_t> labels_of_intensity(const RecordedScan& scan) {
  constexpr std::uint32_t kOtherObject = 99, kMovingOtherVehicle = 259;
  std::vector<std::uint32_t> labels;
  for (std::size_t k = 3; k < scan.xyzi.size(); k += 4) {
    labels.push_back(scan.xyzi[k] > 0.0F ? kMovingOtherVehicle : kOtherObject);
  }
  return labels;
}

}  // namespace

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
    : folder_(path), options_(options) {
  if (!(options.sensor_origin.array().abs() <= kMaxSensor).all()) {
    throw ConfigError("the origin of the sensor must be finite and within " +
                      std::to_string(static_cast<int>(kMaxSensor)) + " m of that of the clouds");
  }
  const auto tables = is_folder(path) ? nuscenes_tables(path) : std::nullopt;
  if (is_log(path)) {
    open_log();
  } else if (tables) {
    open_nuscenes(*tables);
  } else {
    if (!is_folder(path)) {
      const auto conversion = conversion_of(path);
      fail(path, conversion ? *conversion : std::string("is not a folder; ") + kAccepted);
    }
    if (!find_scan_folder() && has_logs(path)) {
      open_log();
    } else {
      list_scans();
      reader_ = make_file_reader(format_, options_.bin_layout);
      options.without_poses ? leave_unplaced() : read_poses();
    }
  }
  find_columns();
  refuse_idle(options, format_, columns_);
  find_sensors();
  frame_ = options.frame == PointFrame::kAuto ? guess_frame() : options.frame;
  notes_.push_back(frame_ == PointFrame::kWorld ? "points are in the frame of the world"
                                                : "points are in the frame of the sensor");
  if (!sensor_origin().isZero(0.0)) {
    std::ostringstream note;
    text::exact(note);
    const Eigen::Vector3d& at = sensor_origin();
    note << "the sensor is at (" << at.x() << ' ' << at.y() << ' ' << at.z()
         << ") m in the frame of the clouds";
    notes_.push_back(note.str());
  }
  if (options.without_poses && frame_ == PointFrame::kWorld) {
    fail(folder_,
         "points are in the frame of the world, so their scans had poses; expected points "
         "in the frame of the sensor (--frame sensor)");
  }
  if (options.without_poses && columns_.time && !options.is_compensated) options_.deskew = true;
  if (options_.deskew) prepare_deskewing();
  tell_lost_scans();
}

/// Warns of scans that are missing among scans at even intervals.
void Recording::tell_lost_scans() {
  constexpr double kEven = 0.2;  // of the usual interval
  std::vector<double> steps;
  for (std::size_t i = 1; i < scans_.size(); ++i) {
    if (scans_[i].match != scans_[i - 1].match + 1) continue;
    steps.push_back(scans_[i].time - scans_[i - 1].time);
  }
  const double period = median(steps);
  std::size_t even = 0;
  double lost = 0.0, longest = 0.0;
  for (const double step : steps) {
    even += std::abs(step / period - 1.0) < kEven ? 1 : 0;
    lost += std::max(0.0, std::round(step / period) - 1.0);
    longest = std::max(longest, step);
  }
  if (!has_times_ || lost == 0.0 || 10 * even < 9 * steps.size()) return;
  warnings_.push_back(text::to_text(lost) + " scans seem to be missing: the longest interval is " +
                      text::to_text(std::round(longest / period)) + " times the usual one");
}

/// Takes scans, times and poses of a log. Poses of a file belong to the clouds by time.
void Recording::open_log() {
  if (!options_.times.empty()) {
    fail(options_.times, "expected no file of times: " + folder_.string() + " has stamps");
  }
  const bool has_file = !options_.poses.empty();
  auto log = std::make_unique<LogScans>(folder_, options_, !has_file && !options_.without_poses);
  scan_folder_ = folder_;
  format_ = ScanFormat::kLog;
  frame_ = log->is_in_world() ? PointFrame::kWorld : PointFrame::kSensor;
  files_ = log->log().files();
  early_end_ = log->log().early_end();
  if (early_end_) {
    warnings_.push_back(*early_end_ + "; " + std::to_string(log->size()) +
                        " scans before it are read");
  }
  if (log->log().missing_parts()) warnings_.push_back(*log->log().missing_parts());
  notes_ = log->notes();
  warnings_.insert(warnings_.end(), log->warnings().begin(), log->warnings().end());
  numbered_ = true;
  for (std::size_t i = 0; i < log->size(); ++i) {
    std::ostringstream name;
    text::exact(name);
    name << std::setw(6) << std::setfill('0') << i;
    scans_.push_back({folder_, name.str(), i, log->times()[i]});
  }
  if (has_file) files_.push_back(options_.poses);
  if (options_.without_poses) {
    if (!options_.sensor_frame.empty()) take_sensor_frame(*log);
    reader_ = make_log_reader(std::move(log));
    return leave_unplaced();
  }
  trajectory_ = has_file ? read_trajectory(options_.poses) : log->trajectory();
  if (options_.deskew && !has_file) motion_ = log->motion();
  const fs::path& poses = has_file ? options_.poses : folder_;
  if (!options_.sensor_frame.empty()) take_sensor_frame(*log);
  trajectory_.times.empty() ? match_rows(poses) : match_times(poses, log->times());
  reader_ = make_log_reader(std::move(log));
  place_scans(poses);
}

void Recording::take_sensor_frame(const LogScans& log) {
  const auto T_cloud_sensor = log.T_cloud_frame(options_.sensor_frame);
  if (!T_cloud_sensor) {
    fail(folder_, "expected a transform from the frame of the clouds to frame " +
                      options_.sensor_frame + "; found transforms of " + log.known_frames());
  }
  options_.sensor_origin = T_cloud_sensor->translation();
}

/// Takes the sweeps of one scene. Poses of a file belong to the sweeps by time.
void Recording::open_nuscenes(const fs::path& tables) {
  if (!options_.times.empty()) {
    fail(options_.times, "expected no file of times: " + tables.string() + " has times");
  }
  const NuScenesSweeps nuscenes = read_nuscenes(folder_, tables, options_.scene);
  files_ = nuscenes.tables;
  scan_folder_ = nuscenes.sweeps.front().file.parent_path();
  format_ = ScanFormat::kNuScenes;
  reader_ = make_file_reader(format_, options_.bin_layout);
  notes_.push_back("sweeps, poses and times of nuScenes");
  std::vector<double> times;
  for (const NuScenesSweep& sweep : nuscenes.sweeps) {
    scans_.push_back({sweep.file, name_of_scan(sweep.file), scans_.size(), sweep.time});
    files_.push_back(sweep.file);
    times.push_back(sweep.time);
    if (times.size() > 1 && !(times.back() > times[times.size() - 2])) {
      fail(tables / "sample_data.json", "expected one sweep at a time, found a second one for " +
                                            sweep.file.filename().string());
    }
    trajectory_.poses.push_back(sweep.T_world_sensor);
  }
  check_names();
  if (options_.without_poses) {
    trajectory_ = Trajectory();
    return leave_unplaced();
  }
  trajectory_.times = times;
  if (!options_.poses.empty()) {
    files_.push_back(options_.poses);
    trajectory_ = read_trajectory(options_.poses);
  }
  const fs::path& poses = options_.poses.empty() ? tables : options_.poses;
  trajectory_.times.empty() ? match_rows(poses) : match_times(poses, times);
  place_scans(poses);
}

/// False if neither the folder nor one below it has scans.
bool Recording::find_scan_folder() {
  scan_folder_ = folder_;
  for (const char* name : {"velodyne", "pcd", "ply", "scans", "points", "clouds", "lidar", "Scans",
                           "velodyne_points/data"}) {
    if (is_folder(folder_ / name) &&
        (!scan_files(folder_ / name).empty() || std::string_view(name) == "velodyne")) {
      scan_folder_ = folder_ / name;
      return true;
    }
  }
  return !scan_files(folder_).empty();
}

void Recording::list_scans() {
  const std::vector<fs::path> files = scan_files(scan_folder_);
  if (files.empty()) {
    const auto conversion = conversion_of_scans(scan_folder_);
    fail(scan_folder_, conversion ? *conversion : std::string("has no scans; ") + kAccepted);
  }
  files_ = files;
  format_ = *scan_format_of(files.front());
  for (const fs::path& file : files) {
    if (*scan_format_of(file) == format_) continue;
    fail(scan_folder_, "expected scans of one kind, found " + files.front().filename().string() +
                           " and " + file.filename().string());
  }

  const bool is_usual = options_.bin_layout.columns == 4 && !options_.bin_layout.is_double;
  if (format_ == ScanFormat::kBin && is_usual) check_bin_content(files.front());
  for (const fs::path& file : files) {
    scans_.emplace_back();
    scans_.back().file = file;
    scans_.back().name = name_of_scan(file);
  }
  check_names();
  numbered_ = std::all_of(scans_.begin(), scans_.end(),
                          [](const Scan& scan) { return is_number(scan.name); });
  for (const Scan& scan : scans_) {
    const bool is_kitti = format_ == ScanFormat::kBin && scan_folder_ == folder_ / "velodyne";
    if (!is_kitti || scan.name.find_first_not_of("0123456789._") == std::string::npos) continue;
    fail(scan.file, "expected a number as name, such as 000123.bin");
  }
  for (std::size_t i = 0; i < scans_.size(); ++i) {
    scans_[i].number = numbered_ ? std::stoull(scans_[i].name) : i;
    if (i > 0 && numbered_ && scans_[i].number == scans_[i - 1].number) {
      fail(scan_folder_, "two scans with one number: " + scans_[i - 1].file.filename().string() +
                             " and " + scans_[i].file.filename().string());
    }
  }
}

/// Results of a scan are named like the scan, so no two scans may have one name.
void Recording::check_names() const {
  std::map<std::string, fs::path> files;
  for (const Scan& scan : scans_) {
    const auto [other, is_new] = files.emplace(scan.name, scan.file);
    if (is_new) continue;
    fail(scan_folder_, "expected scans of different names, found " +
                           other->second.filename().string() + " and " +
                           scan.file.filename().string());
  }
}

std::vector<fs::path> Recording::files() const {
  std::vector<fs::path> files = files_;
  files.insert(files.end(), options_.sources.begin(), options_.sources.end());
  if (labels_ != Labels::kFiles) return files;
  for (const Scan& scan : scans_) files.push_back(label_file(folder_, scan.name));
  return files;
}

void Recording::find_columns() {
  columns_ = reader_->columns(address(0));
  if (columns_.label) labels_ = Labels::kColumn;
  if (is_folder(folder_ / "labels")) labels_ = Labels::kFiles;
  if (labels_ != Labels::kNone || !has_labels_as_intensity()) return;
  labels_ = Labels::kIntensity;
  notes_.push_back("intensity 1 labels moving points, 0 static ones");
}

/// Whether some scans in the form of DynamicMap_Benchmark have the intensities 0 and 1, and no
/// others.
bool Recording::has_labels_as_intensity() const {
  if (!has_viewpoints_ || !columns_.intensity) return false;
  bool has_moving = false, has_static = false;
  RecordedScan scan;
  for (const std::size_t i : {std::size_t{0}, size() / 2, size() - 1}) {
    reader_->read(address(i), nullptr, scan);
    for (std::size_t k = 3; k < scan.xyzi.size(); k += 4) {
      const float intensity = scan.xyzi[k];
      if (intensity != 0.0F && intensity != 1.0F) return false;
      (intensity == 1.0F ? has_moving : has_static) = true;
    }
  }
  return has_moving && has_static;
}

ScanAddress Recording::address(std::size_t i) const {
  const Scan& scan = scans_.at(i);
  return {scan.file, scan.match};
}

/// Points are densest around the sensor: compares the number of points around the origin with the
/// number around the position of a scan that is far from the origin.
PointFrame Recording::guess_frame() const {
  constexpr double kNear = 8.0;  // m
  const PointFrame usual = has_viewpoints_ ? PointFrame::kWorld : PointFrame::kSensor;
  if (format_ == ScanFormat::kBin || format_ == ScanFormat::kNuScenes ||
      format_ == ScanFormat::kLog) {
    return frame_;
  }
  const auto farthest =
      std::max_element(scans_.begin(), scans_.end(), [](const Scan& a, const Scan& b) {
        return a.T_world_sensor.translation().norm() < b.T_world_sensor.translation().norm();
      });
  const Eigen::Vector3d position = farthest->T_world_sensor.translation();
  if (position.norm() < 2.0 * kNear) return usual;  // the two overlap
  std::size_t around_origin = 0;
  std::size_t around_pose = 0;
  for (const Eigen::Vector3d& read : read_points(farthest->file).positions) {
    const Eigen::Vector3d p = options_.point_unit * read;
    if (p.norm() < kNear) ++around_origin;
    if ((p - position).norm() < kNear) ++around_pose;
  }
  if (around_origin == around_pose) return usual;
  return around_pose > around_origin ? PointFrame::kWorld : PointFrame::kSensor;
}

const LogScans* Recording::log() const { return reader_->log(); }

std::uint64_t Recording::point_count(std::size_t i) const {
  return reader_->point_count(address(i));
}

/// From the coordinates of a file to the sensor frame, m; nothing if they are the same.
std::optional<FileTransform> Recording::T_sensor_file(std::size_t i) const {
  const bool is_in_world = frame_ == PointFrame::kWorld;
  if (!is_in_world && options_.point_unit == 1.0) return std::nullopt;
  FileTransform T = FileTransform::Identity();
  if (is_in_world) T = T_world_sensor(i).inverse();
  if (options_.point_unit != 1.0) T.scale(options_.point_unit);
  return T;
}

void Recording::read_scan(std::size_t i, RecordedScan& scan) const {
  const std::optional<FileTransform> T = T_sensor_file(i);
  reader_->read(address(i), T ? &*T : nullptr, scan);
  if (frame_ == PointFrame::kSensor && !sensor_origin().isZero(0.0)) {
    subtract_origin(sensor_origin().cast<float>(), scan);
  }
  read_sensors(i, scan);
  if (!options_.self_boxes.empty()) clear_boxes(options_.self_boxes, scan);
  if (options_.deskew && !motion_.poses.empty())
    deskew(motion_, time(i), T_world_sensor(i), *clock_, file(i), scan);
}

void Recording::find_sensors() {
  const fs::path file = folder_ / kSensorPoses;
  if (options_.sensors.empty() && is_folder(folder_) && is_file(file)) {
    options_.sensors = read_trajectory(file).poses;
    files_.push_back(file);
  }
  if (options_.sensors.empty()) return;
  if (!sensor_origin().isZero(0.0)) {
    throw ConfigError("the origin of one sensor and the poses of several exclude each other");
  }
  notes_.push_back("points are of " + std::to_string(options_.sensors.size()) + " sensors");
}

/// Numbers of the sensors in a file beside the scans take the place of those of the scan.
void Recording::read_sensors(std::size_t i, RecordedScan& scan) const {
  if (options_.sensors.empty()) {
    scan.sensor.clear();
    return;
  }
  const fs::path file = folder_ / kSensorFolder / (name(i) + ".id");
  if (is_file(file)) {
    ByteReader reader(file);
    if (reader.remaining() != scan.size()) {
      fail(file, "has " + std::to_string(reader.remaining()) + " bytes, expected one for each of " +
                     std::to_string(scan.size()) + " points");
    }
    const std::string bytes = reader.read_block(scan.size(), "sensors of points");
    scan.sensor.assign(bytes.begin(), bytes.end());
  }
  if (options_.sensor_beams > 0) {
    for (std::uint8_t& sensor : scan.sensor) {
      sensor = static_cast<std::uint8_t>(sensor / options_.sensor_beams);
    }
  }
}

RecordedScan Recording::read_scan(std::size_t i) const {
  RecordedScan scan;
  read_scan(i, scan);
  return scan;
}

bool Recording::has_labels(std::size_t i) const {
  return labels_ == Labels::kFiles ? fs::exists(label_file(folder_, name(i))) : has_labels();
}

std::vector<std::uint32_t> Recording::read_labels(std::size_t i) const {
  if (labels_ == Labels::kIntensity) return labels_of_intensity(read_scan(i));
  if (labels_ != Labels::kFiles) return reader_->read_labels(address(i));
  return dynains::read_labels(label_file(folder_, name(i)), point_count(i));
}

}  // namespace dynains
