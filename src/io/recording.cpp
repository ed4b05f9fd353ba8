#include "dynains/io/recording.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <map>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "deskew.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/kitti.hpp"
#include "dynains/io/point_file.hpp"
#include "failure.hpp"
#include "input_file.hpp"
#include "kitti_files.hpp"
#include "log/log_scans.hpp"
#include "median.hpp"
#include "nuscenes.hpp"
#include "scan_reader.hpp"
#include "text.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

constexpr const char* kAccepted =
    "expected a KITTI folder (velodyne/NNNNNN.bin, poses.txt), or a folder of .pcd, .ply, .bin, "
    ".las, .npy, .npz, .xyz or .csv scans (or with them in pcd/, ply/, scans/, points/, clouds/ or "
    "lidar/), or a log of ROS "
    "(.mcap, "
    ".db3, .bag, or a folder with metadata.yaml)";

std::optional<ScanFormat> scan_format_of(const fs::path& path) {
  const std::string extension = text::lower_case(path.extension().string());
  if (extension == ".bin" && path.stem().extension() == ".pcd") return ScanFormat::kNuScenes;
  if (extension == ".bin") return ScanFormat::kBin;
  if (extension == ".pcd") return ScanFormat::kPcd;
  if (extension == ".ply") return ScanFormat::kPly;
  if (extension == ".las") return ScanFormat::kLas;
  if (extension == ".npy") return ScanFormat::kNpy;
  if (extension == ".npz") return ScanFormat::kNpz;
  if (extension == ".xyz") return ScanFormat::kXyz;
  if (extension == ".csv") return ScanFormat::kCsv;
  return std::nullopt;
}

/// Beside scans of these formats, files of the other ones are no scans.
bool is_for_scans_only(ScanFormat format) {
  return format == ScanFormat::kBin || format == ScanFormat::kPcd || format == ScanFormat::kPly ||
         format == ScanFormat::kNuScenes;
}

constexpr std::array<const char*, 6> kPoseFiles = {
    "poses.txt", "poses.csv", "poses.tum", "trajectory.txt", "trajectory.csv", "trajectory.tum"};

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Compares runs of digits by value: scan2 comes before scan10.
bool is_before(const std::string& a, const std::string& b) {
  std::size_t i = 0;
  std::size_t k = 0;
  while (i < a.size() && k < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[k])) {
      if (a[i] != b[k]) return a[i] < b[k];
      ++i;
      ++k;
      continue;
    }
    const auto run = [](const std::string& text, std::size_t& at) {
      while (at < text.size() && text[at] == '0') ++at;
      const std::size_t begin = at;
      while (at < text.size() && is_digit(text[at])) ++at;
      return std::string_view(text).substr(begin, at - begin);
    };
    const std::string_view x = run(a, i);
    const std::string_view y = run(b, k);
    if (x.size() != y.size()) return x.size() < y.size();
    if (x != y) return x < y;
  }
  if (a.size() - i != b.size() - k) return a.size() - i < b.size() - k;
  return a < b;
}

/// Scan files directly in `folder`, except hidden ones.
std::vector<fs::path> scan_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path& path = entry->path();
    const std::string name = path.filename().string();
    const bool has_poses =
        std::find(kPoseFiles.begin(), kPoseFiles.end(), name) != kPoseFiles.end();
    if (!scan_format_of(path) || name.front() == '.' || has_poses) continue;
    files.push_back(path);
  }
  if (error) fail(folder, "cannot be listed: " + error.message());
  const auto is_scan = [](const fs::path& path) {
    return is_for_scans_only(*scan_format_of(path));
  };
  if (std::any_of(files.begin(), files.end(), is_scan)) {
    files.erase(std::stable_partition(files.begin(), files.end(), is_scan), files.end());
  }
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return is_before(a.filename().string(), b.filename().string());
  });
  return files;
}

std::string name_of_scan(const fs::path& file) {
  const fs::path stem = file.stem();
  return scan_format_of(file) == ScanFormat::kNuScenes ? stem.stem().string() : stem.string();
}

/// For a folder whose only scans are in known formats that are not read: how to convert them.
std::optional<std::string> conversion_of_scans(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const auto conversion = conversion_of(entry->path());
    if (conversion) return entry->path().filename().string() + ": " + *conversion;
  }
  return std::nullopt;
}

/// Time in seconds of a name that is a time.
std::optional<double> time_of_name(const std::string& name) {
  const auto digits = [](std::string_view text) {
    return !text.empty() && std::all_of(text.begin(), text.end(), is_digit);
  };
  const std::size_t separator = name.find_first_of("._-");
  if (separator == std::string::npos) {
    if (!digits(name) || name.size() < 10 || name.size() > 19 || name.front() == '0') {
      return std::nullopt;
    }
    return to_seconds(*text::parse_number(name));
  }
  const std::string whole = name.substr(0, separator);
  const std::string part = name.substr(separator + 1);
  if (!digits(whole) || !digits(part) || whole.size() > 12 || part.size() > 9) return std::nullopt;
  if (name[separator] == '.') return text::parse_number(name);
  // SECONDS_NANOSECONDS, as the stamps of ROS have it.
  if (whole.size() != 10) return std::nullopt;
  return *text::parse_number(whole) + 1e-9 * *text::parse_number(part);
}

bool is_identity(const Eigen::Isometry3d& pose) {
  return pose.isApprox(Eigen::Isometry3d::Identity(), 1e-12);
}

std::string in_seconds(double time) {
  std::ostringstream text;
  text::exact(text);
  text.precision(15);
  text << time << " s";
  return text.str();
}

/// Proposes a longer gap if most gaps of the trajectory are too long; else empty.
std::string gap_hint(const Trajectory& trajectory, double longest) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < trajectory.times.size(); ++i) {
    gaps.push_back(trajectory.times[i] - trajectory.times[i - 1]);
  }
  const double usual = median(std::move(gaps));
  if (!(usual > longest)) return {};
  return ". Poses are " + in_seconds(usual) +
         " apart: --pose-gap takes them, at the cost of the error of a linear motion between them";
}

std::string shown(const fs::path& path, const fs::path& folder) {
  const fs::path shorter = path.lexically_relative(folder);
  return shorter.empty() || *shorter.begin() == ".." ? path.string() : shorter.string();
}

}  // namespace

Recording::Recording(const fs::path& path, const RecordingOptions& options)
    : folder_(path), options_(options) {
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
    list_scans();
    reader_ = make_file_reader(format_);
    read_poses();
  }
  find_columns();
  frame_ = options.frame == PointFrame::kAuto ? guess_frame() : options.frame;
  notes_.push_back(frame_ == PointFrame::kWorld ? "points are in the frame of the world"
                                                : "points are in the frame of the sensor");
  if (options.deskew) prepare_deskewing();
}

/// The trajectory if it has times of its own, else the poses of the scans.
void Recording::prepare_deskewing() {
  if (!columns_.time) fail(folder_, "de-skewing needs a time for each point, a column time");
  if (frame_ == PointFrame::kWorld) {
    fail(folder_, "de-skewing needs points in the frame of the sensor");
  }
  notes_.push_back("points are de-skewed by their times");
  const Trajectory& rows = motion_.times.empty() ? trajectory_ : motion_;
  const PoseConvention& convention = options_.convention;
  Trajectory motion;
  if (convention.shift == 0 && rows.times.size() > 1) {
    // A scan at time t has the pose at t + time_offset.
    for (const double time : rows.times) motion.times.push_back(time - options_.time_offset);
    for (const Eigen::Isometry3d& row : rows.poses) {
      motion.poses.push_back(to_sensor_pose(convention, apply(convention, row, trajectory_.order)));
    }
  } else {
    for (const Scan& scan : scans_) {
      motion.times.push_back(scan.time);
      motion.poses.push_back(scan.T_world_sensor);
    }
  }
  motion_ = std::move(motion);
}

/// Takes scans, times and poses of a log. Poses of a file belong to the clouds by time.
void Recording::open_log() {
  if (!options_.times.empty()) {
    fail(options_.times, "expected no file of times: " + folder_.string() + " has stamps");
  }
  const bool has_file = !options_.poses.empty();
  auto log = std::make_unique<LogScans>(
      folder_,
      LogChoice{options_.cloud_topic, options_.pose_topic, options_.pose_frame, !has_file});
  scan_folder_ = folder_;
  format_ = ScanFormat::kLog;
  frame_ = log->is_in_world() ? PointFrame::kWorld : PointFrame::kSensor;
  files_ = log->log().files();
  early_end_ = log->log().early_end();
  notes_ = log->notes();
  numbered_ = true;
  for (std::size_t i = 0; i < log->size(); ++i) {
    std::ostringstream name;
    text::exact(name);
    name << std::setw(6) << std::setfill('0') << i;
    scans_.push_back({folder_, name.str(), i, log->times()[i]});
  }
  if (has_file) files_.push_back(options_.poses);
  trajectory_ = has_file ? read_trajectory(options_.poses) : log->trajectory();
  if (options_.deskew && !has_file) motion_ = log->motion();
  const fs::path& poses = has_file ? options_.poses : folder_;
  trajectory_.times.empty() ? match_rows(poses) : match_times(poses, log->times());
  reader_ = make_log_reader(std::move(log));
  place_scans(poses);
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
  reader_ = make_file_reader(format_);
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
  trajectory_.times = times;
  if (!options_.poses.empty()) {
    files_.push_back(options_.poses);
    trajectory_ = read_trajectory(options_.poses);
  }
  const fs::path& poses = options_.poses.empty() ? tables : options_.poses;
  trajectory_.times.empty() ? match_rows(poses) : match_times(poses, times);
  place_scans(poses);
}

void Recording::list_scans() {
  scan_folder_ = folder_;
  for (const char* name : {"velodyne", "pcd", "ply", "scans", "points", "clouds", "lidar"}) {
    if (is_folder(folder_ / name) &&
        (!scan_files(folder_ / name).empty() || std::string_view(name) == "velodyne")) {
      scan_folder_ = folder_ / name;
      break;
    }
  }
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

  if (scan_folder_ == folder_ / "velodyne" && format_ == ScanFormat::kBin) {
    numbered_ = true;
    for (const NumberedScan& scan : list_kitti_scans(scan_folder_)) {
      scans_.emplace_back();
      scans_.back().file = scan_folder_ / (scan.name + ".bin");
      scans_.back().name = scan.name;
      scans_.back().number = scan.number;
    }
    return;
  }
  for (const fs::path& file : files) {
    scans_.emplace_back();
    scans_.back().file = file;
    scans_.back().name = name_of_scan(file);
  }
  check_names();
  numbered_ = std::all_of(scans_.begin(), scans_.end(), [](const Scan& scan) {
    return scan.name.size() <= 9 && std::all_of(scan.name.begin(), scan.name.end(), is_digit);
  });
  for (std::size_t i = 0; i < scans_.size(); ++i) {
    scans_[i].number = numbered_ ? std::stoull(scans_[i].name) : i;
    if (i > 0 && numbered_ && scans_[i].number == scans_[i - 1].number) {
      fail(scan_folder_,
           "two scans with one number: " + scans_[i - 1].name + " and " + scans_[i].name);
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

fs::path Recording::find_poses() const {
  if (!options_.poses.empty()) return options_.poses;
  std::vector<fs::path> folders = {folder_};
  if (scan_folder_ != folder_) {
    folders.push_back(scan_folder_);
  } else {
    folders.push_back(fs::absolute(folder_).lexically_normal() / "..");
  }
  for (const fs::path& folder : folders) {
    for (const char* name : kPoseFiles) {
      if (is_file(folder / name)) return (folder / name).lexically_normal();
    }
  }
  fail(folder_ / "poses.txt",
       "not found: expected a pose for each scan, there (12 numbers a row, or time x y z qx qy qz "
       "qw), in VIEWPOINT of .pcd scans, or in a file given by --poses");
}

void Recording::read_viewpoints() {
  Trajectory viewpoints;
  viewpoints.order = QuaternionOrder::kWxyz;
  for (const Scan& scan : scans_) {
    viewpoints.poses.push_back(read_point_file_header(scan.file).viewpoint);
    has_viewpoints_ = has_viewpoints_ || !is_identity(viewpoints.poses.back());
  }
  if (has_viewpoints_) trajectory_ = std::move(viewpoints);
}

/// The first existing file of `names` in the folder or beside the poses; empty if there is none.
fs::path Recording::find_beside(const fs::path& poses_file,
                                const std::vector<const char*>& names) const {
  std::vector<fs::path> folders = {folder_};
  if (!poses_file.empty()) folders.push_back(poses_file.parent_path());
  for (const fs::path& folder : folders) {
    for (const char* name : names) {
      if (is_file(folder / name)) return folder / name;
    }
  }
  return {};
}

/// Reads calib.txt, which poses of a camera need.
void Recording::read_calibration(const fs::path& poses_file) {
  const fs::path file = find_beside(poses_file, {"calib.txt"});
  if (file.empty()) return;
  files_.push_back(file);
  const PoseFrame frame = options_.convention.frame;
  const bool is_matrix = trajectory_.order == QuaternionOrder::kNone;
  try {
    Tr_ = read_kitti_calib(file);
    has_calibration_ = true;
  } catch (const IoError& error) {
    if (frame == PoseFrame::kCamera || (frame == PoseFrame::kAuto && is_matrix)) throw;
    notes_.push_back(std::string("not used: ") + error.what());
  }
}

void Recording::read_poses() {
  if (options_.poses.empty() && format_ == ScanFormat::kPcd) read_viewpoints();
  fs::path file;
  if (has_viewpoints_) {
    notes_.push_back("poses from VIEWPOINT of the scans");
  } else {
    file = find_poses();
    files_.push_back(file);
    trajectory_ = read_trajectory(file);
    notes_.push_back("poses from " + shown(file, folder_));
  }
  read_calibration(file);
  match_scans(file);
  place_scans(has_viewpoints_ ? scan_folder_ : file);
}

std::optional<std::vector<double>> Recording::times_of_names() const {
  std::vector<double> times;
  for (const Scan& scan : scans_) {
    const std::optional<double> time = time_of_name(scan.name);
    if (!time) return std::nullopt;
    times.push_back(*time);
  }
  return times;
}

/// Times of the scan files from a file of times or from their names.
std::optional<std::vector<double>> Recording::find_times(const fs::path& poses_file) {
  const fs::path file = options_.times.empty()
                            ? find_beside(poses_file, {"times.txt", "timestamps.txt"})
                            : options_.times;
  if (file.empty()) return times_of_names();
  files_.push_back(file);
  std::vector<double> rows = read_kitti_times(file);
  for (double& time : rows) time = to_seconds(time);
  if (rows.size() == scans_.size()) return rows;
  const bool has_all_numbers = numbered_ && rows.size() > scans_.back().number;
  const bool is_ours = !options_.times.empty() || file.parent_path() == folder_;
  if (!is_ours && !has_all_numbers) {
    notes_.push_back("not used: " + shown(file, folder_) + " has " + std::to_string(rows.size()) +
                     " rows for " + std::to_string(scans_.size()) + " scans");
    return times_of_names();
  }
  if (!numbered_) {
    fail_at_line(file, std::min(rows.size(), scans_.size()) + 1,
                 "expected a row for each of " + std::to_string(scans_.size()) + " scans, found " +
                     std::to_string(rows.size()));
  }
  check_rows(file, rows.size(), scans_.back().number + 1);
  std::vector<double> times;
  for (const Scan& scan : scans_) times.push_back(rows[scan.number]);
  return times;
}

/// Matches rows to scans by order if there are equally many, else by the number of the scan.
void Recording::match_rows(const fs::path& file) {
  const std::size_t rows = trajectory_.poses.size();
  const bool by_order = rows == scans_.size();
  if (!by_order && !numbered_) {
    fail_at_line(file, std::min(rows, scans_.size()) + 1,
                 "expected a row for each of " + std::to_string(scans_.size()) +
                     " scans, or rows and scans with times; found " + std::to_string(rows));
  }
  if (!by_order) check_rows(file, rows, scans_.back().number + 1);
  for (std::size_t i = 0; i < scans_.size(); ++i) {
    const std::size_t row = by_order ? i : static_cast<std::size_t>(scans_[i].number);
    matches_.push_back(TrajectoryMatch{row, row, 0.0});
  }
}

void Recording::match_times(const fs::path& file, const std::vector<double>& times) {
  std::size_t found = 0;
  for (const double time : times) {
    matches_.push_back(match_time(trajectory_, time + options_.time_offset, options_.pose_gap));
    if (matches_.back()) ++found;
  }
  if (2 * found >= times.size()) return;
  fail(file, "has poses from " + in_seconds(trajectory_.times.front()) + " to " +
                 in_seconds(trajectory_.times.back()) + " for " + std::to_string(found) + " of " +
                 std::to_string(times.size()) + " scans, which are from " +
                 in_seconds(times.front()) + " to " + in_seconds(times.back()) +
                 "; expected times of one clock, with gaps of at most " +
                 in_seconds(options_.pose_gap) + gap_hint(trajectory_, options_.pose_gap));
}

void Recording::match_scans(const fs::path& file) {
  // Times beside a file of --poses may belong to another recording.
  const std::optional<std::vector<double>> times =
      find_times(options_.poses.empty() ? file : fs::path());
  if (times) {
    for (std::size_t i = 0; i < scans_.size(); ++i) {
      scans_[i].time = (*times)[i];
      if (i > 0 && !(scans_[i].time > scans_[i - 1].time)) {
        fail(scans_[i].file, "expected a time after that of the scan before, " +
                                 in_seconds(scans_[i - 1].time) + "; found " +
                                 in_seconds(scans_[i].time));
      }
    }
  }
  if (!trajectory_.times.empty() && times) {
    match_times(file, *times);
    notes_.push_back("poses belong to scans by time, interpolated");
    return;
  }
  match_rows(file);
  note_rows(file);
  for (std::size_t i = 0; i < scans_.size() && !times; ++i) {
    const std::size_t row = matches_[i]->before;
    scans_[i].time = trajectory_.times.empty() ? kKittiPeriod * static_cast<double>(row)
                                               : trajectory_.times[row];
  }
  if (!times && trajectory_.times.empty()) notes_.push_back("no times: 0.1 s from scan to scan");
  if (options_.time_offset != 0.0) shift_times(file);
}

/// Notes how rows without times belong to scans.
void Recording::note_rows(const fs::path& file) {
  const std::size_t rows = trajectory_.poses.size();
  if (rows == scans_.size()) {
    notes_.push_back("poses belong to scans one by one");
    return;
  }
  notes_.push_back(std::to_string(rows) + " poses for " + std::to_string(scans_.size()) +
                   " scans in " + shown(file, folder_) +
                   ": row N belongs to the scan with number N, counted from 0");
}

/// Matches scans to the times of their rows plus the offset.
void Recording::shift_times(const fs::path& file) {
  if (trajectory_.times.empty()) {
    fail(file, "has no times, which an offset of the time needs; expected rows with times");
  }
  std::vector<double> times;
  for (const Scan& scan : scans_) times.push_back(scan.time);
  matches_.clear();
  match_times(file, times);
}

/// Sets the poses of scans and leaves out scans without one. `poses`: their file or folder.
void Recording::place_scans(const fs::path& poses) {
  const std::size_t all = scans_.size();
  std::vector<Scan> placed;
  std::string missing;
  for (std::size_t i = 0; i < all; ++i) scans_[i].match = i;
  for (std::size_t i = 0; i < all; ++i) {
    const auto pose = pose_under(options_.convention, i);
    if (pose) {
      placed.push_back(scans_[i]);
      placed.back().T_world_sensor = *pose;
    } else if (missing.empty()) {
      missing = scans_[i].name;
    }
  }
  if (placed.empty()) fail(poses, "has no pose for any scan; check --pose-shift");
  if (placed.size() < all) {
    notes_.push_back(std::to_string(all - placed.size()) + " of " + std::to_string(all) +
                     " scans have no pose and are left out, " + missing + " first");
  }
  scans_ = std::move(placed);
}

std::vector<fs::path> Recording::files() const {
  std::vector<fs::path> files = files_;
  if (labels_ != Labels::kFiles) return files;
  for (const Scan& scan : scans_) files.push_back(folder_ / "labels" / (scan.name + ".label"));
  return files;
}

std::optional<Eigen::Isometry3d> Recording::pose_under(const PoseConvention& convention,
                                                       std::size_t i) const {
  const auto at = static_cast<std::ptrdiff_t>(scans_.at(i).match) + convention.shift;
  if (at < 0 || at >= static_cast<std::ptrdiff_t>(matches_.size())) return std::nullopt;
  const std::optional<TrajectoryMatch>& match = matches_[static_cast<std::size_t>(at)];
  if (!match) return std::nullopt;
  return pose_of(convention, *match);
}

std::optional<Eigen::Isometry3d> Recording::pose_after(std::size_t i, double offset) const {
  const double time = scans_.at(i).time + options_.time_offset + offset;
  const auto match = match_time(trajectory_, time, options_.pose_gap);
  if (!match) return std::nullopt;
  return pose_of(options_.convention, *match);
}

Eigen::Isometry3d Recording::pose_of(const PoseConvention& convention,
                                     const TrajectoryMatch& match) const {
  const QuaternionOrder order = trajectory_.order;
  return to_sensor_pose(
      convention,
      interpolate(apply(convention, trajectory_.poses[match.before], order),
                  apply(convention, trajectory_.poses[match.after], order), match.share));
}

/// T_world_sensor of a pose to which the rest of the convention was applied.
Eigen::Isometry3d Recording::to_sensor_pose(const PoseConvention& convention,
                                            const Eigen::Isometry3d& pose) const {
  const bool is_matrix = trajectory_.order == QuaternionOrder::kNone;
  const bool is_camera = convention.frame == PoseFrame::kCamera ||
                         (convention.frame == PoseFrame::kAuto && has_calibration_ && is_matrix);
  if (!is_camera) return pose * convention.T_body_sensor;
  const Eigen::Isometry3d T_camera_sensor = has_calibration_ ? Tr_ : camera_axes();
  return T_camera_sensor.inverse() * pose * T_camera_sensor * convention.T_body_sensor;
}

void Recording::find_columns() {
  columns_ = reader_->columns(address(0));
  if (columns_.label) labels_ = Labels::kColumn;
  if (is_folder(folder_ / "labels")) labels_ = Labels::kFiles;
}

ScanAddress Recording::address(std::size_t i) const {
  const Scan& scan = scans_.at(i);
  return {scan.file, scan.match};
}

/// Points are densest around the sensor: compares the number of points around the origin with the
/// number around the position of a scan that is far from the origin.
PointFrame Recording::guess_frame() const {
  constexpr double kNear = 8.0;      // m
  constexpr double kFarPose = 20.0;  // m, so that the two do not overlap
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
  if (position.norm() < kFarPose) return usual;
  std::size_t around_origin = 0;
  std::size_t around_pose = 0;
  for (const Eigen::Vector3d& p : read_points(farthest->file).positions) {
    if (p.norm() < kNear) ++around_origin;
    if ((p - position).norm() < kNear) ++around_pose;
  }
  if (around_origin == around_pose) return usual;
  return around_pose > around_origin ? PointFrame::kWorld : PointFrame::kSensor;
}

std::uint64_t Recording::point_count(std::size_t i) const {
  return reader_->point_count(address(i));
}

void Recording::check_scan(std::size_t i) const { reader_->check(address(i)); }

void Recording::read_scan(std::size_t i, RecordedScan& scan) const {
  const Eigen::Isometry3d T_sensor_world = T_world_sensor(i).inverse();
  reader_->read(address(i), frame_ == PointFrame::kWorld ? &T_sensor_world : nullptr, scan);
  if (options_.deskew) deskew(motion_, time(i), T_world_sensor(i), file(i), scan);
}

RecordedScan Recording::read_scan(std::size_t i) const {
  RecordedScan scan;
  read_scan(i, scan);
  return scan;
}

std::vector<std::uint32_t> Recording::read_labels(std::size_t i) const {
  if (labels_ != Labels::kFiles) return reader_->read_labels(address(i));
  return dynains::read_labels(folder_ / "labels" / (name(i) + ".label"), point_count(i));
}

}  // namespace dynains
