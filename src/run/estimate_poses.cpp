#include "estimate_poses.hpp"

#include <algorithm>
#include <future>
#include <sstream>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"
#include "dynains/odometry/odometry.hpp"
#include "interrupt.hpp"
#include "io/byte_reader.hpp"
#include "io/fingerprint.hpp"
#include "io/text.hpp"
#include "recorded_scans.hpp"
#include "run_plan.hpp"

namespace dynains::run {
namespace {

std::string loss_at(const Recording& recording, std::size_t scan, std::size_t done,
                    const OdometryResult& result) {
  std::string text = recording.folder().string() + ": the odometry lost track at scan " +
                     recording.name(scan) + ": " +
                     value_names(result.loss)[static_cast<std::size_t>(result.loss)];
  if (result.loss == OdometryLoss::kNoOverlap) {
    text += " (it fits to their surfaces by " +
            std::to_string(static_cast<int>(100.0 * result.fit)) + " %)";
  }
  return text + "; " + std::to_string(done) + " scans before it have poses";
}

/// Poses of the scans up to the last one that is not lost. Reads the recording until it returns.
PoseEstimate find_poses(const Recording& recording, const ScanRange& range, bool one_thread,
                        const std::function<void(std::size_t, std::size_t)>& progress,
                        std::vector<Pose>& poses) {
  const InterruptGuard interrupt;
  DynaInsRemover::Config remover = DynaInsRemover::Config::odometry();
  take_sensors(recording, remover);
  Odometry odometry({}, remover);
  PoseEstimate estimate;
  RecordedScan scan;
  std::optional<std::string> loss;  // since the last scan that is not lost
  std::size_t known = 0;            // scans up to it
  ReadAhead scans(recording, range.first, range.last,
                  one_thread ? std::launch::deferred : std::launch::async);
  progress(0, range.size());
  for (std::size_t i = range.first; i <= range.last; ++i) {
    scan = scans.next(std::move(scan));
    const std::vector<double> offsets = recording.point_offsets(i, scan);
    const OdometryResult result = odometry.push(points_of(scan), offsets, recording.time(i));
    InterruptGuard::check();
    if (result.loss == OdometryLoss::kNone) {
      known = poses.size() + 1;
      loss.reset();
    } else {
      if (!loss) loss = loss_at(recording, i, poses.size(), result);
      estimate.lost_scans.push_back(poses.size());
    }
    if (result.free_directions > 0) ++estimate.uncertain_scans;
    TimingRow& row = estimate.timing.rows.emplace_back();
    row.began_epoch = result.frame.began_epoch;
    row.plausibility = result.frame.plausibility;
    poses.push_back(result.T_world_sensor);
    progress(poses.size(), range.size());
  }
  poses.resize(known, Pose::Identity());
  estimate.timing.rows.resize(known);
  std::vector<std::size_t>& lost = estimate.lost_scans;
  lost.erase(std::lower_bound(lost.begin(), lost.end(), known), lost.end());
  estimate.loss = loss;
  return estimate;
}

std::string trajectory_head(const std::string& rows) {
  Fingerprint fingerprint;
  fingerprint.add(rows);
  return "# dynains odometry " + fingerprint.text() + '\n';
}

}  // namespace

PoseEstimate estimate_poses(Recording& recording, const ScanWindow& window, bool one_thread,
                            const std::function<void(std::size_t, std::size_t)>& progress) {
  const ScanRange range = select_scans(recording, window);
  if (range.size() < 2) {
    throw ConfigError(recording.folder().string() +
                      ": the odometry needs two scans or more, found one");
  }
  std::vector<Pose> poses;
  const PoseEstimate estimate = find_poses(recording, range, one_thread, progress, poses);
  if (poses.size() < 2) throw LostTrack(*estimate.loss);
  recording.take_poses(range.first, poses);
  return estimate;
}

void write_trajectory(const std::filesystem::path& file, const Recording& recording) {
  std::ostringstream rows;
  text::exact(rows);
  rows << "# time x y z qx qy qz qw\n";
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const Pose& T = recording.T_world_sensor(i);
    const Eigen::Vector3d t = T.translation();
    const Eigen::Quaterniond q(T.linear());
    rows << recording.time(i) << ' ' << t.x() << ' ' << t.y() << ' ' << t.z() << ' ' << q.x() << ' '
         << q.y() << ' ' << q.z() << ' ' << q.w() << '\n';
  }
  AtomicFile writer(file);
  writer.stream() << trajectory_head(rows.str()) << rows.str();
  writer.commit();
}

bool is_own_trajectory(const std::filesystem::path& file) {
  if (!is_file(file)) return false;
  const std::string content = read_text_file(file);
  const std::size_t end = content.find('\n') + 1;  // npos + 1 is 0
  return content.substr(0, end) == trajectory_head(content.substr(end));
}

}  // namespace dynains::run
