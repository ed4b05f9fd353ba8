// A simulated drive on disk, whose poses and points can be replaced.
#pragma once

#include "dynains/io/kitti.hpp"
#include "dynains/io/point_file.hpp"
#include "dynains/io/recording.hpp"
#include "io/files.hpp"
#include "simulation/simulator.hpp"
#include "simulation/write_sequence.hpp"
#include "support/standard.hpp"

namespace dynains::test {

/// Writes a scan as PCD with the time `time_of(s)` of each point that was measured `s` seconds
/// after the time of the scan.
inline void write_timed_scan(const std::filesystem::path& path, const std::vector<float>& xyzi,
                             const std::vector<float>& times,
                             const std::function<double(double)>& time_of) {
  PointColumns columns;
  columns.time = true;
  PointFileWriter file(path, columns);
  for (std::size_t k = 0; k < times.size(); ++k) {
    FilePoint point;
    point.position = Eigen::Map<const Eigen::Vector3f>(&xyzi[4 * k]).cast<double>();
    point.time = time_of(static_cast<double>(times[k]));
    file.add(point);
  }
  file.commit();
}

/// A folder of KITTI with the scans and the true poses of a simulated drive.
class WrittenDrive {
 public:
  explicit WrittenDrive(const simulation::Config& config) {
    simulation::Simulator simulator(config);
    std::filesystem::create_directories(path() / "velodyne");
    for (std::size_t i = 0; i < simulator.size(); ++i) {
      scans_.push_back(simulator.scan(i));
      write_scan(file_of(i), scans_.back().xyzi);
    }
    const std::vector<Pose> rows = poses();
    write_poses(path() / "poses.txt", rows);
  }

  const std::filesystem::path& path() const { return folder_.path(); }
  std::size_t size() const { return scans_.size(); }
  const simulation::SimulatedScan& scan(std::size_t i) const { return scans_[i]; }
  const Pose& pose(std::size_t i) const { return scans_[i].T_world_sensor; }
  std::vector<Pose> poses() const {
    std::vector<Pose> rows;
    for (const simulation::SimulatedScan& scan : scans_) rows.push_back(scan.T_world_sensor);
    return rows;
  }
  std::filesystem::path file_of(std::size_t i) const {
    return path() / ("velodyne/" + simulation::scan_name(i) + ".bin");
  }

  /// Writes `pose_of(i, T_world_sensor)` as the pose of each scan i, and opens the recording.
  Recording with_poses(const std::function<Pose(std::size_t, const Pose&)>& pose_of) const {
    std::vector<Pose> rows = poses();
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = pose_of(i, rows[i]);
    write_poses(path() / "poses.txt", rows);
    return Recording(path());
  }

  /// Writes `move(scan, p)` in place of each point p (m, sensor frame).
  using Move =
      std::function<Eigen::Vector3d(const simulation::SimulatedScan&, const Eigen::Vector3d&)>;
  void move_points(const Move& move) const {
    for (std::size_t i = 0; i < size(); ++i) {
      std::vector<float> xyzi = scans_[i].xyzi;
      for (std::size_t k = 0; k < xyzi.size(); k += 4) {
        Eigen::Map<Eigen::Vector3f> p(&xyzi[k]);
        p = move(scans_[i], p.cast<double>()).cast<float>();
      }
      write_scan(file_of(i), xyzi);
    }
  }

  /// Writes the drive into another folder by write_timed_scan().
  void write_with_times(
      const std::filesystem::path& folder,
      const std::function<double(double)>& time_of = [](double s) { return s; }) const {
    std::filesystem::create_directories(folder / "pcd");
    std::vector<double> times;
    for (std::size_t i = 0; i < size(); ++i) {
      write_timed_scan(folder / "pcd" / (simulation::scan_name(i) + ".pcd"), scans_[i].xyzi,
                       scans_[i].times, time_of);
      times.push_back(scans_[i].time);
    }
    write_times(folder / "times.txt", times);
    const std::vector<Pose> rows = poses();
    write_poses(folder / "poses.txt", rows);
  }

 private:
  TemporaryFolder folder_;
  std::vector<simulation::SimulatedScan> scans_;
};

// Wrong poses of a drive.

inline Pose inverse_pose(std::size_t, const Pose& T) { return T.inverse(); }
inline Pose no_motion(std::size_t, const Pose&) { return Pose::Identity(); }
/// Ways `factor` times as long.
inline std::function<Pose(std::size_t, const Pose&)> scaled_poses(double factor) {
  return [factor](std::size_t, Pose T) {
    T.translation() *= factor;
    return T;
  };
}

}  // namespace dynains::test
