// Poses and times of a recording, and how they belong to its scans.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "../byte_reader.hpp"
#include "../failure.hpp"
#include "../points/point_clock.hpp"
#include "../scan_files.hpp"
#include "../scan_reader.hpp"
#include "../text.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/point_file.hpp"
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

/// T_world_sensor of a pose to which the rest of the convention was applied.
Pose to_sensor_pose(const RecordingContents& r, const PoseConvention& convention,
                    const Pose& pose) {
  const bool is_matrix = r.trajectory.order == QuaternionOrder::kNone;
  const bool is_camera = convention.frame == PoseFrame::kCamera ||
                         (convention.frame == PoseFrame::kAuto && r.T_camera_sensor && is_matrix);
  Pose T_world_sensor = pose * convention.T_body_sensor;
  if (is_camera) {
    const Pose T_camera_sensor = r.T_camera_sensor.value_or(camera_axes());
    T_world_sensor = T_camera_sensor.inverse() * pose * T_camera_sensor * convention.T_body_sensor;
  }
  if (!r.options.sensor_origin.isZero(0.0)) T_world_sensor.translate(r.options.sensor_origin);
  return T_world_sensor;
}

Pose pose_of(const RecordingContents& r, const PoseConvention& convention,
             const TrajectoryMatch& match) {
  const QuaternionOrder order = r.trajectory.order;
  return to_sensor_pose(
      r, convention,
      interpolate(apply(convention, r.trajectory.poses[match.before], order),
                  apply(convention, r.trajectory.poses[match.after], order), match.share));
}

/// The folder of a file of poses; without one, that of the recording.
fs::path folder_of(const RecordingContents& r, const fs::path& poses_file) {
  return poses_file.empty() ? r.folder : poses_file.parent_path();
}

/// The first existing file of `names` in the folder of the recording or in another one; empty if
/// there is none.
fs::path first_file(const RecordingContents& r, const fs::path& other,
                    const std::vector<const char*>& names) {
  for (const fs::path& folder : {r.folder, other}) {
    for (const char* name : names) {
      if (is_file(folder / name)) return folder / name;
    }
  }
  return {};
}

fs::path find_poses(const RecordingContents& r) {
  if (!r.options.poses.empty()) return r.options.poses;
  const fs::path other =
      r.scan_folder == r.folder ? fs::absolute(r.folder).lexically_normal() / ".." : r.scan_folder;
  const fs::path file = first_file(r, other, {kPoseFiles.begin(), kPoseFiles.end()});
  if (!file.empty()) return file.lexically_normal();
  fail(r.folder / "poses.txt",
       "not found: expected a pose for each scan, there (12 numbers a row, or time x y z qx qy qz "
       "qw), in VIEWPOINT of .pcd scans, or in a file given by --poses; without poses, dynains run "
       "--odometry estimates them");
}

void read_viewpoints(RecordingContents& r) {
  Trajectory viewpoints;
  viewpoints.order = QuaternionOrder::kWxyz;
  for (const ScanEntry& scan : r.scans) {
    viewpoints.poses.push_back(Pose::Identity());
    try {
      viewpoints.poses.back() = read_point_file_header(scan.file).viewpoint;
    } catch (const IoError&) {
      if (!r.options.accept_missing) throw;
    }
    r.has_viewpoints = r.has_viewpoints || !is_identity(viewpoints.poses.back());
  }
  if (r.has_viewpoints) r.trajectory = std::move(viewpoints);
}

/// Reads calib.txt, which poses of a camera need.
void read_calibration(RecordingContents& r, const fs::path& poses_file) {
  const fs::path file = first_file(r, folder_of(r, poses_file), {"calib.txt"});
  if (file.empty()) return;
  r.files.push_back(file);
  const PoseFrame frame = r.options.convention.frame;
  const bool is_matrix = r.trajectory.order == QuaternionOrder::kNone;
  try {
    r.T_camera_sensor = read_kitti_calib(file);
  } catch (const IoError& error) {
    if (frame == PoseFrame::kCamera || (frame == PoseFrame::kAuto && is_matrix)) throw;
    r.notes.push_back(std::string("not used: ") + error.what());
  }
}

/// The row of each scan in a file: by order if there are equally many, else by the number of the
/// scan. `other`: what else is expected.
std::vector<std::size_t> rows_of_scans(const RecordingContents& r, const fs::path& file,
                                       std::size_t rows, const std::string& other) {
  const std::size_t scans = r.scans.size();
  if (rows != scans && !r.is_numbered) {
    fail_at_line(file, std::min(rows, scans) + 1,
                 "expected a row for each of " + std::to_string(scans) + " scans" + other +
                     " found " + std::to_string(rows));
  }
  const std::size_t needed = rows == scans ? 0 : r.scans.back().number + 1;
  if (rows < needed) {
    fail_at_line(file, rows + 1,
                 "expected a row for each scan, at least " + std::to_string(needed) + ", found " +
                     std::to_string(rows));
  }
  std::vector<std::size_t> result;
  for (const ScanEntry& scan : r.scans) {
    result.push_back(rows == scans ? result.size() : static_cast<std::size_t>(scan.number));
  }
  return result;
}

/// Times of the scan files from a file of times or from their names.
std::optional<std::vector<double>> find_times(RecordingContents& r, const fs::path& poses_file) {
  const fs::path file = r.options.times.empty() ? first_file(r, folder_of(r, poses_file),
                                                             {"times.txt", "timestamps.txt"})
                                                : r.options.times;
  if (file.empty()) return times_of_names(r.scans);
  r.files.push_back(file);
  std::vector<double> rows = read_kitti_times(file);
  for (double& time : rows) time = to_seconds(time);
  if (rows.size() == r.scans.size()) return rows;
  const bool has_all_numbers = r.is_numbered && rows.size() > r.scans.back().number;
  const bool is_ours = !r.options.times.empty() || file.parent_path() == r.folder;
  if (!is_ours && !has_all_numbers) {
    r.notes.push_back("not used: " + shown(file, r.folder) + " has " + std::to_string(rows.size()) +
                      " rows for " + std::to_string(r.scans.size()) + " scans");
    return times_of_names(r.scans);
  }
  std::vector<double> times;
  for (const std::size_t row : rows_of_scans(r, file, rows.size(), ",")) times.push_back(rows[row]);
  return times;
}

/// Sets the times of scans, if there are any. Throws IoError unless they increase.
void take_times(RecordingContents& r, const std::optional<std::vector<double>>& times) {
  for (std::size_t i = 0; times && i < r.scans.size(); ++i) {
    r.scans[i].time = (*times)[i];
    if (i > 0 && !(r.scans[i].time > r.scans[i - 1].time)) {
      fail(r.scans[i].file, "expected a time after that of the scan before, " +
                                in_seconds(r.scans[i - 1].time) + "; found " +
                                in_seconds(r.scans[i].time));
    }
  }
}

void match_rows(RecordingContents& r, const fs::path& file) {
  const std::size_t rows = r.trajectory.poses.size();
  for (const std::size_t row : rows_of_scans(r, file, rows, ", or rows and scans with times;")) {
    r.matches.push_back(TrajectoryMatch{row, row, 0.0});
  }
}

void match_times(RecordingContents& r, const fs::path& file) {
  std::size_t found = 0;
  for (const ScanEntry& scan : r.scans) {
    r.matches.push_back(
        match_time(r.trajectory, scan.time + r.options.time_offset, r.options.pose_gap));
    if (r.matches.back()) ++found;
  }
  if (2 * found >= r.scans.size()) return;
  fail(file, "has poses from " + in_seconds(r.trajectory.times.front()) + " to " +
                 in_seconds(r.trajectory.times.back()) + " for " + std::to_string(found) + " of " +
                 std::to_string(r.scans.size()) + " scans, which are from " +
                 in_seconds(r.scans.front().time) + " to " + in_seconds(r.scans.back().time) +
                 "; expected times of one clock, with gaps of at most " +
                 in_seconds(r.options.pose_gap) + gap_hint(r.trajectory, r.options.pose_gap));
}

/// The first column of KITTI-360 is the number of the scan. False unless the rows begin with the
/// numbers of most scans.
bool match_indices(RecordingContents& r) {
  const bool is_matrix = r.trajectory.order == QuaternionOrder::kNone;
  if (!r.is_numbered || !is_matrix || r.trajectory.times.empty()) return false;
  const std::vector<double>& indices = r.trajectory.times;
  const auto is_index = [](double time) { return time >= 0.0 && time == std::floor(time); };
  if (!std::all_of(indices.begin(), indices.end(), is_index)) return false;
  std::size_t found = 0;
  std::vector<std::optional<TrajectoryMatch>> matches;
  for (const ScanEntry& scan : r.scans) {
    const auto number = static_cast<double>(scan.number);
    const auto row = std::lower_bound(indices.begin(), indices.end(), number);
    if (row == indices.end() || *row != number) {
      matches.emplace_back();
      continue;
    }
    const auto at = static_cast<std::size_t>(row - indices.begin());
    matches.push_back(TrajectoryMatch{at, at, 0.0});
    ++found;
  }
  if (2 * found < r.scans.size()) return false;
  r.matches = std::move(matches);
  for (double& time : r.trajectory.times) time *= kKittiPeriod;
  for (ScanEntry& scan : r.scans) scan.time = kKittiPeriod * static_cast<double>(scan.number);
  r.has_times = false;
  r.notes.push_back(
      "the first column of the poses counts scans: each row belongs to the scan of that number, "
      "0.1 s from number to number");
  return true;
}

/// Notes how rows without times belong to scans.
void note_rows(RecordingContents& r, const fs::path& file) {
  const std::size_t rows = r.trajectory.poses.size();
  if (rows == r.scans.size()) {
    r.notes.push_back("poses belong to scans one by one");
    return;
  }
  const std::string text = std::to_string(rows) + " poses for " + std::to_string(r.scans.size()) +
                           " scans in " + shown(file, r.folder) +
                           ": row N belongs to the scan with number N, counted from 0";
  // Scans with numbers of their own have gaps, or begin elsewhere; many more rows are those of a
  // longer recording.
  const bool may_be_renumbered =
      r.scans.front().number <= 1 &&
      r.scans.back().number - r.scans.front().number + 1 == r.scans.size();
  if (may_be_renumbered && 2 * rows <= 3 * r.scans.size()) {
    r.warnings.push_back(text +
                         "; if clouds were lost and the others renumbered, poses are wrong "
                         "behind the loss");
  } else {
    r.notes.push_back(text);
  }
}

void match_scans(RecordingContents& r, const fs::path& file) {
  // Times beside a file of --poses may belong to another recording.
  const std::optional<std::vector<double>> times =
      find_times(r, r.options.poses.empty() ? file : fs::path());
  take_times(r, times);
  if (!r.trajectory.times.empty() && times) {
    match_times(r, file);
    r.notes.push_back("poses belong to scans by time, interpolated");
    return;
  }
  if (times || !match_indices(r)) {
    match_rows(r, file);
    note_rows(r, file);
  }
  for (std::size_t i = 0; i < r.scans.size() && !times && r.has_times; ++i) {
    const std::size_t row = r.matches[i]->before;
    r.scans[i].time = r.trajectory.times.empty() ? kKittiPeriod * static_cast<double>(row)
                                                 : r.trajectory.times[row];
  }
  if (!times && r.trajectory.times.empty()) {
    r.has_times = false;
    r.notes.push_back("no times: 0.1 s from scan to scan");
  }
  if (r.options.time_offset == 0.0) return;
  if (r.trajectory.times.empty()) {
    fail(file, "has no times, which an offset of the time needs; expected rows with times");
  }
  r.matches.clear();
  match_times(r, file);
}

/// Pose of the scan of that index (see ScanEntry) under a convention; empty if it has none.
std::optional<Pose> pose_under(const RecordingContents& r, const PoseConvention& convention,
                               std::size_t index) {
  const auto at = static_cast<std::ptrdiff_t>(index) + convention.shift;
  if (at < 0 || at >= static_cast<std::ptrdiff_t>(r.matches.size())) return std::nullopt;
  const std::optional<TrajectoryMatch>& match = r.matches[static_cast<std::size_t>(at)];
  if (!match) return std::nullopt;
  return pose_of(r, convention, *match);
}

/// Sets the poses of scans and leaves out scans without one. `poses`: their file or folder.
void place_scans(RecordingContents& r, const fs::path& poses) {
  const std::size_t all = r.scans.size();
  std::vector<ScanEntry> placed;
  std::string missing;
  for (std::size_t i = 0; i < all; ++i) r.scans[i].index = i;
  for (std::size_t i = 0; i < all; ++i) {
    const auto pose = pose_under(r, r.options.convention, i);
    if (pose) {
      placed.push_back(r.scans[i]);
      placed.back().T_world_sensor = *pose;
      check_pose(poses, r.scans[i].name, *pose);
    } else if (missing.empty()) {
      missing = r.scans[i].name;
    }
  }
  if (placed.empty()) fail(poses, "has no pose for any scan; check --pose-shift");
  if (placed.size() < all) {
    r.warnings.push_back(std::to_string(all - placed.size()) + " of " + std::to_string(all) +
                         " scans have no pose and are left out, " + missing + " first");
  }
  r.scans = std::move(placed);
}

void find_point_clock(RecordingContents& r, const ScanReader& reader) {
  if (r.clock) return;  // that of merged clouds
  std::vector<double> times;
  for (const ScanEntry& scan : r.scans) times.push_back(scan.time);
  RecordedScan scan;
  const auto read = [&](std::size_t i) -> const RecordedScan& {
    reader.read(r.scans[i], nullptr, scan);
    return scan;
  };
  std::optional<PointClock> clock = found_clock(r, "", times, read);
  if (!clock) {
    clock.emplace();
    if (r.options.point_time_unit > 0.0) clock->unit = r.options.point_time_unit;
  }
  r.clock = std::make_shared<const PointClock>(*clock);
}

}  // namespace

std::optional<Pose> Recording::pose_under(const PoseConvention& convention, std::size_t i) const {
  return dynains::pose_under(contents_, convention, contents_.scans.at(i).index);
}

std::optional<Pose> Recording::pose_after(std::size_t i, double offset) const {
  const RecordingOptions& options = contents_.options;
  const double time = contents_.scans.at(i).time + offset + options.time_offset;
  const auto match = match_time(contents_.trajectory, time, options.pose_gap);
  if (!match) return std::nullopt;
  return pose_of(contents_, options.convention, *match);
}

void leave_unplaced(RecordingContents& r) {
  if (r.format == ScanFormat::kPcd) read_viewpoints(r);
  const bool has_stamps = r.format == ScanFormat::kLog || r.format == ScanFormat::kNuScenes;
  const auto times = has_stamps ? std::nullopt : find_times(r, {});
  take_times(r, times);
  r.has_times = times || has_stamps;
  for (std::size_t i = 0; i < r.scans.size(); ++i) {
    r.scans[i].index = i;
    if (!r.has_times) r.scans[i].time = kKittiPeriod * static_cast<double>(i);
  }
  if (!r.has_times) r.notes.push_back("no times: 0.1 s from scan to scan");
  r.matches.assign(r.scans.size(), std::nullopt);
}

void pose_by_stamps(RecordingContents& r, const fs::path& origin) {
  const bool has_file = !r.options.poses.empty();
  if (has_file) r.files.push_back(r.options.poses);
  if (r.options.without_poses) {
    r.trajectory = Trajectory();
    return leave_unplaced(r);
  }
  if (has_file) r.trajectory = read_trajectory(r.options.poses);
  const fs::path& poses = has_file ? r.options.poses : origin;
  r.trajectory.times.empty() ? match_rows(r, poses) : match_times(r, poses);
  place_scans(r, poses);
}

void read_poses(RecordingContents& r) {
  if (r.options.poses.empty() && r.format == ScanFormat::kPcd) read_viewpoints(r);
  fs::path file;
  if (r.has_viewpoints) {
    r.notes.push_back("poses from VIEWPOINT of the scans");
  } else {
    file = find_poses(r);
    r.files.push_back(file);
    r.trajectory = read_trajectory(file);
    r.notes.push_back("poses from " + shown(file, r.folder));
  }
  read_calibration(r, file);
  match_scans(r, file);
  place_scans(r, r.has_viewpoints ? r.scan_folder : file);
}

std::optional<PointClock> found_clock(RecordingContents& r, const std::string& topic,
                                      const std::vector<double>& times,
                                      const std::function<const RecordedScan&(std::size_t)>& read) {
  const PointClockFinding finding = find_clock(times, r.has_times, r.options.point_time_unit, read);
  if (!finding.clock && !finding.text.empty()) {
    fail(r.folder, (topic.empty() ? "" : topic + ' ') + "cannot be de-skewed: " + finding.text);
  }
  if (!finding.text.empty()) {
    r.warnings.push_back((topic.empty() ? "" : topic + ": ") + finding.text);
  }
  return finding.clock;
}

void prepare_deskewing(RecordingContents& r, const ScanReader& reader) {
  if (!r.columns.time && !r.clock)
    fail(r.folder, "de-skewing needs a time for each point, a column time");
  if (r.frame == PointFrame::kWorld) {
    fail(r.folder, "de-skewing needs points in the frame of the sensor");
  }
  find_point_clock(r, reader);
  r.notes.push_back(r.options.deskew ? "points are de-skewed by their times"
                                     : "clouds move to the stamp of their scan by the poses");
  if (r.options.without_poses) return;
  const Trajectory& rows = r.motion.times.empty() ? r.trajectory : r.motion;
  const PoseConvention& convention = r.options.convention;
  Trajectory motion;
  if (convention.shift == 0 && rows.times.size() > 1) {
    // A scan at time t has the pose at t + time_offset.
    for (const double time : rows.times) motion.times.push_back(time - r.options.time_offset);
    for (const Pose& row : rows.poses) {
      motion.poses.push_back(
          to_sensor_pose(r, convention, apply(convention, row, r.trajectory.order)));
    }
  } else {
    for (const ScanEntry& scan : r.scans) {
      motion.times.push_back(scan.time);
      motion.poses.push_back(scan.T_world_sensor);
    }
  }
  r.motion = std::move(motion);
}

void Recording::take_poses(std::size_t first, const std::vector<Pose>& T_world_sensor) {
  RecordingContents& r = contents_;
  if (!r.options.without_poses || T_world_sensor.empty() || first >= r.scans.size() ||
      T_world_sensor.size() > r.scans.size() - first) {
    throw UsageError("a recording without poses takes at most one for each scan");
  }
  const auto begin = r.scans.begin() + static_cast<std::ptrdiff_t>(first);
  r.scans =
      std::vector<ScanEntry>(begin, begin + static_cast<std::ptrdiff_t>(T_world_sensor.size()));
  r.trajectory = Trajectory();
  r.trajectory.order = QuaternionOrder::kXyzw;
  r.motion = Trajectory();
  for (std::size_t i = 0; i < r.scans.size(); ++i) {
    r.scans[i].T_world_sensor = T_world_sensor[i];
    r.matches[r.scans[i].index] = TrajectoryMatch{i, i, 0.0};
    r.motion.times.push_back(r.scans[i].time);
    r.trajectory.poses.push_back(T_world_sensor[i]);
    r.trajectory.poses.back().translate(-r.options.sensor_origin);
  }
  r.motion.poses = T_world_sensor;
  if (r.has_times) r.trajectory.times = r.motion.times;
}

}  // namespace dynains
