#include "targets.hpp"

#include <stdexcept>

namespace dynains::fuzz {

const std::vector<Target>& targets() {
  static const std::vector<Target> all = {
      {"scan", run_scan, scan_seeds},
      {"labels", run_labels, label_seeds},
      {"calib", run_calib, calib_seeds},
      {"times", run_times, time_seeds},
      {"ply", run_ply, ply_seeds},
      {"pcd", run_pcd, pcd_seeds},
      {"las", run_las, las_seeds},
      {"npy", run_npy, npy_seeds},
      {"xyz", run_xyz, xyz_seeds},
      {"config", run_config, config_seeds},
      {"session", run_session, session_seeds},
      {"trajectory", run_trajectory, trajectory_seeds},
      {"recording", run_recording, recording_seeds},
      {"log", run_log, log_seeds},
      {"nuscenes", run_nuscenes, nuscenes_seeds},
      {"facade", run_facade, facade_seeds},
  };
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

}  // namespace dynains::fuzz
