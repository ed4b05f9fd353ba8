#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "byte_reader.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/point_file.hpp"
#include "dynains/median.hpp"
#include "failure.hpp"
#include "logs/log_scans.hpp"
#include "points/bin_layout.hpp"
#include "scan_files.hpp"
#include "scan_reader.hpp"
#include "text.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxSensor = 1000.0;  // m, as of RemoverConfig::sensors

constexpr const char* kAccepted =
    "expected a KITTI folder (velodyne/NNNNNN.bin, poses.txt), or a folder of .pcd, .ply, .bin, "
    ".las, .npy, .xyz or .csv scans (or with them in pcd/, ply/, scans/, points/, clouds/ or "
    "lidar/), or a log of ROS (.mcap, .db3, .bag, or a folder with metadata.yaml)";

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

/// False if neither the folder nor one below it has scans.
bool find_scan_folder(RecordingContents& r) {
  r.scan_folder = r.folder;
  for (const char* name : {"velodyne", "pcd", "ply", "scans", "points", "clouds", "lidar", "Scans",
                           "velodyne_points/data"}) {
    if (is_folder(r.folder / name) &&
        (!scan_files(r.folder / name).empty() || std::string_view(name) == "velodyne")) {
      r.scan_folder = r.folder / name;
      return true;
    }
  }
  return !scan_files(r.folder).empty();
}

/// Results of a scan are named like the scan, so no two scans may have one name.
void check_names(const RecordingContents& r) {
  std::map<std::string, fs::path> files;
  for (const ScanEntry& scan : r.scans) {
    const auto [other, is_new] = files.emplace(scan.name, scan.file);
    if (is_new) continue;
    fail(r.scan_folder, "expected scans of different names, found " +
                            other->second.filename().string() + " and " +
                            scan.file.filename().string());
  }
}

void list_scans(RecordingContents& r) {
  const std::vector<fs::path> files = scan_files(r.scan_folder);
  if (files.empty()) {
    for (const fs::path& path : paths_in(r.scan_folder)) {
      const auto conversion = conversion_of(path);
      if (conversion) fail(r.scan_folder, path.filename().string() + ": " + *conversion);
    }
    fail(r.scan_folder, std::string("has no scans; ") + kAccepted);
  }
  r.files = files;
  r.format = *scan_format_of(files.front());
  for (const fs::path& file : files) {
    if (*scan_format_of(file) == r.format) continue;
    fail(r.scan_folder, "expected scans of one kind, found " + files.front().filename().string() +
                            " and " + file.filename().string());
  }

  if (r.format == ScanFormat::kBin && is_usual(r.options.bin_layout)) {
    check_bin_content(files.front());
  }
  for (const fs::path& file : files) {
    ScanEntry& scan = r.scans.emplace_back();
    scan.file = file;
    scan.name = name_of_scan(file);
  }
  check_names(r);
  r.is_numbered = std::all_of(r.scans.begin(), r.scans.end(),
                              [](const ScanEntry& scan) { return is_number(scan.name); });
  for (const ScanEntry& scan : r.scans) {
    const bool is_kitti = r.format == ScanFormat::kBin && r.scan_folder == r.folder / "velodyne";
    if (!is_kitti || scan.name.find_first_not_of("0123456789._") == std::string::npos) continue;
    fail(scan.file, "expected a number as name, such as 000123.bin");
  }
  for (std::size_t i = 0; i < r.scans.size(); ++i) {
    r.scans[i].number = r.is_numbered ? std::stoull(r.scans[i].name) : i;
    if (i > 0 && r.is_numbered && r.scans[i].number == r.scans[i - 1].number) {
      fail(r.scan_folder, "two scans with one number: " + r.scans[i - 1].file.filename().string() +
                              " and " + r.scans[i].file.filename().string());
    }
  }
}

/// Whether some scans in the form of DynamicMap_Benchmark have the intensities 0 and 1, and no
/// others.
bool has_labels_as_intensity(const RecordingContents& r, const ScanReader& reader) {
  if (!r.has_viewpoints || !r.columns.intensity) return false;
  bool has_moving = false, has_static = false;
  RecordedScan scan;
  for (const std::size_t i : {std::size_t{0}, r.scans.size() / 2, r.scans.size() - 1}) {
    reader.read(r.scans[i], nullptr, scan);
    for (std::size_t k = 3; k < scan.xyzi.size(); k += 4) {
      const float intensity = scan.xyzi[k];
      if (intensity != 0.0F && intensity != 1.0F) return false;
      (intensity == 1.0F ? has_moving : has_static) = true;
    }
  }
  return has_moving && has_static;
}

void find_columns(RecordingContents& r, const ScanReader& reader) {
  r.columns = reader.columns(r.scans.front());
  if (r.columns.label) r.labels = LabelSource::kColumn;
  if (is_folder(r.folder / "labels")) r.labels = LabelSource::kFiles;
  if (r.labels != LabelSource::kNone || !has_labels_as_intensity(r, reader)) return;
  r.labels = LabelSource::kIntensity;
  r.notes.push_back("intensity 1 labels moving points, 0 static ones");
}

void find_sensors(RecordingContents& r) {
  const fs::path file = r.folder / "sensors.txt";
  if (r.options.sensors.empty() && is_folder(r.folder) && is_file(file)) {
    r.options.sensors = read_trajectory(file).poses;
    r.files.push_back(file);
  }
  if (r.options.sensors.empty()) return;
  if (!r.options.sensor_origin.isZero(0.0)) {
    throw ConfigError("the origin of one sensor and the poses of several exclude each other");
  }
  r.notes.push_back("points are of " + std::to_string(r.options.sensors.size()) + " sensors");
}

/// Points are densest around the sensor: compares the number of points around the origin with the
/// number around the position of a scan that is far from the origin.
PointFrame guess_frame(const RecordingContents& r) {
  constexpr double kNear = 8.0;  // m
  const PointFrame usual = r.has_viewpoints ? PointFrame::kWorld : PointFrame::kSensor;
  if (r.format == ScanFormat::kBin || r.format == ScanFormat::kNuScenes ||
      r.format == ScanFormat::kLog) {
    return r.frame;
  }
  const auto farthest =
      std::max_element(r.scans.begin(), r.scans.end(), [](const ScanEntry& a, const ScanEntry& b) {
        return a.T_world_sensor.translation().norm() < b.T_world_sensor.translation().norm();
      });
  const Eigen::Vector3d position = farthest->T_world_sensor.translation();
  if (position.norm() < 2.0 * kNear) return usual;  // the two overlap
  std::size_t around_origin = 0;
  std::size_t around_pose = 0;
  for (const Eigen::Vector3d& read : read_points(farthest->file).positions) {
    const Eigen::Vector3d p = r.options.point_unit * read;
    if (p.norm() < kNear) ++around_origin;
    if ((p - position).norm() < kNear) ++around_pose;
  }
  if (around_origin == around_pose) return usual;
  return around_pose > around_origin ? PointFrame::kWorld : PointFrame::kSensor;
}

/// Warns of scans that are missing among scans at even intervals, to 20 % of the usual one.
void warn_of_lost_scans(RecordingContents& r) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < r.scans.size(); ++i) {
    if (r.scans[i].index != r.scans[i - 1].index + 1) continue;
    steps.push_back(r.scans[i].time - r.scans[i - 1].time);
  }
  const double period = median(steps);
  std::size_t even = 0;
  double lost = 0.0, longest = 0.0;
  for (const double step : steps) {
    even += std::abs(step / period - 1.0) < 0.2 ? 1 : 0;
    lost += std::max(0.0, std::round(step / period) - 1.0);
    longest = std::max(longest, step);
  }
  if (!r.has_times || lost == 0.0 || 10 * even < 9 * steps.size()) return;
  r.warnings.push_back(text::to_text(lost) + " scans seem to be missing: the longest interval is " +
                       text::to_text(std::round(longest / period)) + " times the usual one");
}

/// Leaves out scans whose files are too short for their points.
void leave_out_broken(RecordingContents& r, const ScanReader& reader) {
  std::string first;
  const auto is_broken = [&](const ScanEntry& scan) {
    try {
      reader.point_count(scan);
      return false;
    } catch (const IoError& error) {
      if (first.empty()) first = error.what();
      return true;
    }
  };
  const std::size_t all = r.scans.size();
  r.scans.erase(std::remove_if(r.scans.begin(), r.scans.end(), is_broken), r.scans.end());
  if (first.empty()) return;
  if (r.scans.empty()) throw IoError(first);
  r.warnings.push_back(std::to_string(all - r.scans.size()) + " of " + std::to_string(all) +
                       " scan files are broken and left out: " + first);
}

/// Finds the format, and takes scans, times and poses.
std::unique_ptr<ScanReader> open_scans(RecordingContents& r) {
  const auto tables = is_folder(r.folder) ? nuscenes_tables(r.folder) : std::nullopt;
  if (is_log(r.folder)) return open_log_scans(r);
  if (tables) {
    read_nuscenes(r, *tables);
    check_names(r);
    pose_by_stamps(r, *tables);
  } else {
    if (!is_folder(r.folder)) {
      const auto conversion = conversion_of(r.folder);
      fail(r.folder, conversion ? *conversion : std::string("is not a folder; ") + kAccepted);
    }
    if (!find_scan_folder(r) && has_logs(r.folder)) return open_log_scans(r);
    list_scans(r);
    r.options.without_poses ? leave_unplaced(r) : read_poses(r);
  }
  return make_file_reader(r.format, r.options.bin_layout);
}

void note_frame(RecordingContents& r) {
  const bool is_in_world = r.frame == PointFrame::kWorld;
  r.notes.push_back(is_in_world ? "points are in the frame of the world"
                                : "points are in the frame of the sensor");
  const Eigen::Vector3d& at = r.options.sensor_origin;
  if (!at.isZero(0.0)) {
    std::ostringstream note;
    text::exact(note);
    note << "the sensor is at (" << at.x() << ' ' << at.y() << ' ' << at.z()
         << ") m in the frame of the clouds";
    r.notes.push_back(note.str());
  }
  if (r.options.without_poses && is_in_world) {
    fail(r.folder,
         "points are in the frame of the world, so their scans had poses; expected points "
         "in the frame of the sensor (--frame sensor)");
  }
}

}  // namespace

std::unique_ptr<ScanReader> open_recording(const fs::path& path, const RecordingOptions& options,
                                           RecordingContents& r) {
  if (!(options.sensor_origin.array().abs() <= kMaxSensor).all()) {
    throw ConfigError("the origin of the sensor must be finite and within " +
                      std::to_string(static_cast<int>(kMaxSensor)) + " m of that of the clouds");
  }
  r.folder = path;
  r.options = options;
  std::unique_ptr<ScanReader> reader = open_scans(r);
  if (options.accept_missing) leave_out_broken(r, *reader);
  find_columns(r, *reader);
  refuse_idle(options, r.format, r.columns);
  find_sensors(r);
  r.frame = options.frame == PointFrame::kAuto ? guess_frame(r) : options.frame;
  note_frame(r);
  const bool is_raw = options.without_poses && r.columns.time && !options.is_compensated;
  r.options.deskew = options.deskew || is_raw;
  if (r.options.deskew || r.clock) prepare_deskewing(r, *reader);
  warn_of_lost_scans(r);
  return reader;
}

}  // namespace dynains
