#include "targets.hpp"

#include "dynains/errors.hpp"

namespace dynains::fuzz {

const std::vector<Target>& targets() {
  static const std::vector<Target> all = [] {
    std::vector<Target> result = reader_targets();
    for (const Target& target : recording_targets()) result.push_back(target);
    result.insert(result.end(), {log_target(), nuscenes_target(), facade_target()});
    return result;
  }();
  return all;
}

const Target& target(const std::string& name) {
  for (const Target& candidate : targets()) {
    if (candidate.name == name) return candidate;
  }
  throw std::out_of_range("no target " + name);
}

void require(bool condition, const char* what) {
  if (!condition) throw std::logic_error(what);
}

void require_rigid(const Eigen::Isometry3d& pose) {
  require(pose.matrix().allFinite(), "poses are finite");
  const Eigen::Matrix3d R = pose.linear();
  require((R.transpose() * R).isIdentity(1e-6), "poses are rigid");
}

void check_poses(const Recording& recording) {
  require(recording.size() > 0, "a recording has scans");
  for (std::size_t i = 0; i < recording.size(); ++i) {
    require_rigid(recording.T_world_sensor(i));
    require(std::isfinite(recording.time(i)), "times are finite");
    require(i == 0 || recording.time(i) > recording.time(i - 1), "times increase");
  }
}

void check_recording(const fs::path& place, const Recording& recording, std::size_t bytes) {
  check_poses(recording);
  for (std::size_t i = 0; i < recording.size(); ++i) {
    expect_value_or<IoError>(place, [&](const fs::path&) {
      const std::size_t announced = recording.point_count(i);
      const RecordedScan scan = recording.read_scan(i);
      require(bytes == 0 || scan.size() == announced, "as many points as announced");
      require(bytes == 0 || bytes > (1U << 16U) || scan.size() <= bytes, "points come from bytes");
      require(scan.xyzi.size() % 4 == 0, "points have four numbers");
      require(scan.ring.empty() || scan.ring.size() == scan.size(), "a ring for each point");
      require(scan.time.empty() || scan.time.size() == scan.size(), "a time for each point");
    });
    if (!recording.has_labels()) continue;
    expect_value_or<IoError>(place, [&](const fs::path&) {
      const std::size_t labels = recording.read_labels(i).size();
      require(bytes == 0 || labels == recording.point_count(i), "a label for each point");
    });
  }
}

}  // namespace dynains::fuzz
