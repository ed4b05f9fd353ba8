// Poses and times of a recording, and how they belong to its scans.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "../failure.hpp"
#include "../input_file.hpp"
#include "../points/point_clock.hpp"
#include "../scan_files.hpp"
#include "../scan_reader.hpp"
#include "../text.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/kitti.hpp"
#include "dynains/io/point_file.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/median.hpp"
#include "dynains/pose.hpp"
#include "kitti_files.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

bool is_identity(const Pose& pose) { return pose.isApprox(Pose::Identity(), 1e-12); }

using text::in_seconds;

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

/// Throws for a pose that no map can take, with the file of the poses and the scan.
void check_pose(const fs::path& poses, const std::string& scan, const Pose& T_world_sensor) {
  try {
    validate_pose("T_world_sensor", T_world_sensor);
  } catch (const PoseError& error) {
    fail(poses, "pose of scan " + scan + ": " + error.what());
  }
}

std::string shown(const fs::path& path, const fs::path& folder) {
  const fs::path shorter = path.lexically_relative(folder);
  return shorter.empty() || *shorter.begin() == ".." ? path.string() : shorter.string();
}

}  // namespace

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
       "qw), in VIEWPOINT of .pcd scans, or in a file given by --poses; without poses, dynains run "
       "--odometry estimates them");
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

/// Scans without poses: they have times, and count as matched when they get poses.
void Recording::leave_unplaced() {
  if (format_ == ScanFormat::kPcd) read_viewpoints();
  const bool has_stamps = format_ == ScanFormat::kLog || format_ == ScanFormat::kNuScenes;
  const auto times = has_stamps ? std::nullopt : find_times({});
  take_times(times);
  has_times_ = times || has_stamps;
  for (std::size_t i = 0; i < scans_.size(); ++i) {
    scans_[i].match = i;
    if (!has_times_) scans_[i].time = kKittiPeriod * static_cast<double>(i);
  }
  if (!has_times_) notes_.push_back("no times: 0.1 s from scan to scan");
  matches_.assign(scans_.size(), std::nullopt);
}

void Recording::take_poses(std::size_t first, const std::vector<Pose>& T_world_sensor) {
  if (!options_.without_poses || T_world_sensor.empty() || first >= scans_.size() ||
      T_world_sensor.size() > scans_.size() - first) {
    throw UsageError("a recording without poses takes at most one for each scan");
  }
  const auto begin = scans_.begin() + static_cast<std::ptrdiff_t>(first);
  scans_ = std::vector<Scan>(begin, begin + static_cast<std::ptrdiff_t>(T_world_sensor.size()));
  trajectory_ = Trajectory();
  trajectory_.order = QuaternionOrder::kXyzw;
  motion_ = Trajectory();
  for (std::size_t i = 0; i < scans_.size(); ++i) {
    scans_[i].T_world_sensor = T_world_sensor[i];
    matches_[scans_[i].match] = TrajectoryMatch{i, i, 0.0};
    motion_.times.push_back(scans_[i].time);
    trajectory_.poses.push_back(T_world_sensor[i]);
    trajectory_.poses.back().translate(-sensor_origin());
  }
  motion_.poses = T_world_sensor;
  if (has_times_) trajectory_.times = motion_.times;
}

std::vector<double> Recording::point_offsets(std::size_t i, const RecordedScan& scan) const {
  std::vector<double> offsets;
  if (!options_.deskew || scan.time.size() != scan.size()) return offsets;
  const PointTimes times = times_of_scan(scan, *clock_);
  for (const double point_time : scan.time) {
    offsets.push_back(times.holds(point_time) ? clock_->after(time(i), point_time)
                                              : std::numeric_limits<double>::quiet_NaN());
  }
  return offsets;
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
  std::vector<std::string> names;
  for (const Scan& scan : scans_) names.push_back(scan.name);
  return dynains::times_of_names(names);
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

/// Sets the times of scans, if there are any. Throws IoError unless they increase.
void Recording::take_times(const std::optional<std::vector<double>>& times) {
  for (std::size_t i = 0; times && i < scans_.size(); ++i) {
    scans_[i].time = (*times)[i];
    if (i > 0 && !(scans_[i].time > scans_[i - 1].time)) {
      fail(scans_[i].file, "expected a time after that of the scan before, " +
                               in_seconds(scans_[i - 1].time) + "; found " +
                               in_seconds(scans_[i].time));
    }
  }
}

void Recording::match_scans(const fs::path& file) {
  // Times beside a file of --poses may belong to another recording.
  const std::optional<std::vector<double>> times =
      find_times(options_.poses.empty() ? file : fs::path());
  take_times(times);
  if (!trajectory_.times.empty() && times) {
    match_times(file, *times);
    notes_.push_back("poses belong to scans by time, interpolated");
    return;
  }
  if (times || !match_indices()) {
    match_rows(file);
    note_rows(file);
  }
  for (std::size_t i = 0; i < scans_.size() && !times && has_times_; ++i) {
    const std::size_t row = matches_[i]->before;
    scans_[i].time = trajectory_.times.empty() ? kKittiPeriod * static_cast<double>(row)
                                               : trajectory_.times[row];
  }
  if (!times && trajectory_.times.empty()) {
    has_times_ = false;
    notes_.push_back("no times: 0.1 s from scan to scan");
  }
  if (options_.time_offset != 0.0) shift_times(file);
}

/// The first column of KITTI-360 is the number of the scan. False unless the rows begin with the
/// numbers of most scans.
bool Recording::match_indices() {
  const bool is_matrix = trajectory_.order == QuaternionOrder::kNone;
  if (!numbered_ || !is_matrix || trajectory_.times.empty()) return false;
  const std::vector<double>& indices = trajectory_.times;
  const auto is_index = [](double time) { return time >= 0.0 && time == std::floor(time); };
  if (!std::all_of(indices.begin(), indices.end(), is_index)) return false;
  std::size_t found = 0;
  matches_.clear();
  for (const Scan& scan : scans_) {
    const auto number = static_cast<double>(scan.number);
    const auto row = std::lower_bound(indices.begin(), indices.end(), number);
    if (row == indices.end() || *row != number) {
      matches_.emplace_back();
      continue;
    }
    const auto at = static_cast<std::size_t>(row - indices.begin());
    matches_.push_back(TrajectoryMatch{at, at, 0.0});
    ++found;
  }
  if (2 * found < scans_.size()) {
    matches_.clear();
    return false;
  }
  for (double& time : trajectory_.times) time *= kKittiPeriod;
  for (Scan& scan : scans_) scan.time = kKittiPeriod * static_cast<double>(scan.number);
  has_times_ = false;
  notes_.push_back(
      "the first column of the poses counts scans: each row belongs to the scan of that number, "
      "0.1 s from number to number");
  return true;
}

/// Notes how rows without times belong to scans.
void Recording::note_rows(const fs::path& file) {
  const std::size_t rows = trajectory_.poses.size();
  if (rows == scans_.size()) {
    notes_.push_back("poses belong to scans one by one");
    return;
  }
  const std::string text = std::to_string(rows) + " poses for " + std::to_string(scans_.size()) +
                           " scans in " + shown(file, folder_) +
                           ": row N belongs to the scan with number N, counted from 0";
  // Scans with numbers of their own have gaps, or begin elsewhere; many more rows are those of a
  // longer recording.
  const bool may_be_renumbered = scans_.front().number <= 1 &&
                                 scans_.back().number - scans_.front().number + 1 == scans_.size();
  if (may_be_renumbered && 2 * rows <= 3 * scans_.size()) {
    warnings_.push_back(text +
                        "; if clouds were lost and the others renumbered, poses are wrong "
                        "behind the loss");
  } else {
    notes_.push_back(text);
  }
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
      check_pose(poses, scans_[i].name, *pose);
    } else if (missing.empty()) {
      missing = scans_[i].name;
    }
  }
  if (placed.empty()) fail(poses, "has no pose for any scan; check --pose-shift");
  if (placed.size() < all) {
    warnings_.push_back(std::to_string(all - placed.size()) + " of " + std::to_string(all) +
                        " scans have no pose and are left out, " + missing + " first");
  }
  scans_ = std::move(placed);
}

std::optional<Pose> Recording::pose_under(const PoseConvention& convention, std::size_t i) const {
  const auto at = static_cast<std::ptrdiff_t>(scans_.at(i).match) + convention.shift;
  if (at < 0 || at >= static_cast<std::ptrdiff_t>(matches_.size())) return std::nullopt;
  const std::optional<TrajectoryMatch>& match = matches_[static_cast<std::size_t>(at)];
  if (!match) return std::nullopt;
  return pose_of(convention, *match);
}

std::optional<Pose> Recording::pose_after(std::size_t i, double offset) const {
  const double time = scans_.at(i).time + options_.time_offset + offset;
  const auto match = match_time(trajectory_, time, options_.pose_gap);
  if (!match) return std::nullopt;
  return pose_of(options_.convention, *match);
}

Pose Recording::pose_of(const PoseConvention& convention, const TrajectoryMatch& match) const {
  const QuaternionOrder order = trajectory_.order;
  return to_sensor_pose(
      convention,
      interpolate(apply(convention, trajectory_.poses[match.before], order),
                  apply(convention, trajectory_.poses[match.after], order), match.share));
}

/// T_world_sensor of a pose to which the rest of the convention was applied.
Pose Recording::to_sensor_pose(const PoseConvention& convention, const Pose& pose) const {
  const bool is_matrix = trajectory_.order == QuaternionOrder::kNone;
  const bool is_camera = convention.frame == PoseFrame::kCamera ||
                         (convention.frame == PoseFrame::kAuto && has_calibration_ && is_matrix);
  Pose T_world_sensor = pose * convention.T_body_sensor;
  if (is_camera) {
    const Pose T_camera_sensor = has_calibration_ ? Tr_ : camera_axes();
    T_world_sensor = T_camera_sensor.inverse() * pose * T_camera_sensor * convention.T_body_sensor;
  }
  if (!sensor_origin().isZero(0.0)) T_world_sensor.translate(sensor_origin());
  return T_world_sensor;
}

void Recording::find_point_clock() {
  std::vector<double> times;
  for (const Scan& scan : scans_) times.push_back(scan.time);
  RecordedScan scan;
  const PointClockFinding finding = find_clock(times, has_times_, options_.point_time_unit,
                                               [&](std::size_t i) -> const RecordedScan& {
                                                 reader_->read(address(i), nullptr, scan);
                                                 return scan;
                                               });
  if (!finding.clock && !finding.text.empty()) {
    fail(folder_, "cannot be de-skewed: " + finding.text);
  }
  if (!finding.text.empty()) warnings_.push_back(finding.text);
  PointClock clock = finding.clock.value_or(PointClock());
  if (!finding.clock && options_.point_time_unit > 0.0) clock.unit = options_.point_time_unit;
  clock_ = std::make_shared<const PointClock>(clock);
}

/// The trajectory if it has times of its own, else the poses of the scans.
void Recording::prepare_deskewing() {
  if (!columns_.time) fail(folder_, "de-skewing needs a time for each point, a column time");
  if (frame_ == PointFrame::kWorld) {
    fail(folder_, "de-skewing needs points in the frame of the sensor");
  }
  find_point_clock();
  notes_.push_back("points are de-skewed by their times");
  if (options_.without_poses) return;
  const Trajectory& rows = motion_.times.empty() ? trajectory_ : motion_;
  const PoseConvention& convention = options_.convention;
  Trajectory motion;
  if (convention.shift == 0 && rows.times.size() > 1) {
    // A scan at time t has the pose at t + time_offset.
    for (const double time : rows.times) motion.times.push_back(time - options_.time_offset);
    for (const Pose& row : rows.poses) {
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

}  // namespace dynains
