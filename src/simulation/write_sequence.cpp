#include "simulation/write_sequence.hpp"

#include <string>
#include <system_error>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"
#include "dynains/io/kitti.hpp"

namespace dynains::simulation {
namespace {

/// Sensor to camera axes, as in a KITTI recording: x right, y down, z forward.
Pose camera_from_sensor() {
  Pose Tr = Pose::Identity();
  Tr.linear() << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  Tr.translation() << 0.0, -0.08, -0.27;
  return Tr;
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw IoError(folder.string() + ": cannot create the folder: " + error.message());
}

void write_sensors(const std::filesystem::path& path, const std::vector<std::uint8_t>& sensors) {
  AtomicFile file(path);
  file.stream().write(reinterpret_cast<const char*>(sensors.data()),
                      static_cast<std::streamsize>(sensors.size()));
  file.commit(AtomicFile::Sync::kLater);
}

}  // namespace

std::string scan_name(std::size_t i) {
  std::string name = std::to_string(i);
  name.insert(0, name.size() < 6 ? 6 - name.size() : 0, '0');
  return name;
}

bool write_sequence(Simulator& simulator, const std::filesystem::path& folder,
                    const std::function<bool(std::size_t, std::size_t)>& progress) {
  make_folder(folder / "velodyne");
  make_folder(folder / "labels");
  const std::vector<Pose> mounts = simulator.mounts();
  if (!mounts.empty()) make_folder(folder / "sensor");
  const Pose Tr = camera_from_sensor();
  const Pose Tr_inverse = Tr.inverse();
  std::vector<Pose> poses, true_poses;
  std::vector<double> times;
  for (std::size_t i = 0; i < simulator.size(); ++i) {
    const SimulatedScan scan = simulator.scan(i);
    const std::string name = scan_name(i);
    write_scan(folder / "velodyne" / (name + ".bin"), scan.xyzi);
    write_labels(folder / "labels" / (name + ".label"), scan.labels);
    if (!mounts.empty()) write_sensors(folder / "sensor" / (name + ".id"), scan.sensors);
    poses.push_back(Tr * scan.T_world_sensor_noisy * Tr_inverse);
    true_poses.push_back(Tr * scan.T_world_sensor * Tr_inverse);
    times.push_back(scan.time);
    if (progress && !progress(i + 1, simulator.size())) return false;
  }
  sync_files(folder);
  write_calib(folder / "calib.txt", Tr);
  write_times(folder / "times.txt", times);
  const Config& config = simulator.config();
  if (config.has_pose_errors()) {
    write_poses(folder / "poses_true.txt", true_poses);
  }
  if (!mounts.empty()) write_poses(folder / "sensors.txt", mounts);
  write_poses(folder / "poses.txt", poses);
  return true;
}

}  // namespace dynains::simulation
