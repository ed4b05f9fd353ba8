#include "simulation/write_sequence.hpp"

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "dynains/io/atomic_file.hpp"
#include "dynains/io/kitti.hpp"
#include "io/folder.hpp"
#include "io/logs/mcap_writer.hpp"
#include "io/logs/message_fields.hpp"
#include "io/scalar.hpp"

namespace dynains::simulation {
namespace {

/// Sensor to camera axes, as in a KITTI recording: x right, y down, z forward.
Pose camera_from_sensor() {
  Pose Tr = Pose::Identity();
  Tr.linear() << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  Tr.translation() << 0.0, -0.08, -0.27;
  return Tr;
}

std::string cloud_of(const SimulatedScan& scan, std::uint64_t time) {
  std::vector<PackedField> fields = {{"x", Scalar::kFloat},
                                     {"y", Scalar::kFloat},
                                     {"z", Scalar::kFloat},
                                     {"intensity", Scalar::kFloat},
                                     {"label", Scalar::kUint32}};
  const bool has_times = !scan.times.empty();
  if (has_times) fields.push_back({"time", Scalar::kFloat});
  std::string points;
  points.reserve(scan.labels.size() * 4 * fields.size());
  for (std::size_t i = 0; i < scan.labels.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k) append_number(scan.xyzi[4 * i + k], points);
    append_number(scan.labels[i], points);
    if (has_times) append_number(scan.times[i], points);
  }
  return cloud_message(time, "lidar", fields, points);
}

}  // namespace

std::string scan_name(std::size_t i) {
  std::string name = std::to_string(i);
  name.insert(0, name.size() < 6 ? 6 - name.size() : 0, '0');
  return name;
}

bool write_sequence(Simulator& simulator, const std::filesystem::path& folder,
                    const std::function<bool(std::size_t, std::size_t)>& progress) {
  create_folder(folder / "velodyne");
  create_folder(folder / "labels");
  const std::vector<Pose> mounts = simulator.mounts();
  if (!mounts.empty()) create_folder(folder / "sensor");
  const Pose Tr = camera_from_sensor();
  const Pose Tr_inverse = Tr.inverse();
  std::vector<Pose> poses, true_poses;
  std::vector<double> times;
  for (std::size_t i = 0; i < simulator.size(); ++i) {
    const SimulatedScan scan = simulator.scan(i);
    const std::string name = scan_name(i);
    write_scan(folder / "velodyne" / (name + ".bin"), scan.xyzi);
    write_labels(folder / "labels" / (name + ".label"), scan.labels);
    if (!mounts.empty()) write_point_bytes(folder / "sensor" / (name + ".id"), scan.sensors);
    poses.push_back(Tr * scan.T_world_sensor_noisy * Tr_inverse);
    true_poses.push_back(Tr * scan.T_world_sensor * Tr_inverse);
    times.push_back(scan.time);
    if (progress && !progress(i + 1, simulator.size())) return false;
  }
  sync_files(folder);
  write_calib(folder / "calib.txt", Tr);
  write_times(folder / "times.txt", times);
  if (simulator.config().has_pose_errors()) write_poses(folder / "poses_true.txt", true_poses);
  if (!mounts.empty()) write_poses(folder / "sensors.txt", mounts);
  write_poses(folder / "poses.txt", poses);
  return true;
}

bool write_log(Simulator& simulator, const std::filesystem::path& file,
               const std::function<bool(std::size_t, std::size_t)>& progress) {
  McapWriter writer(file);
  const std::uint16_t clouds = writer.add_channel(ros2_topic("/points", kCloudTopicType));
  const std::uint16_t transforms = writer.add_channel(ros2_topic("/tf", kTransformsTopicType));
  for (std::size_t i = 0; i < simulator.size(); ++i) {
    const SimulatedScan scan = simulator.scan(i);
    const auto time = static_cast<std::uint64_t>(std::llround(scan.time * 1e9));
    writer.write(transforms, time,
                 transform_message(time, "map", "lidar", scan.T_world_sensor_noisy));
    writer.write(clouds, time, cloud_of(scan, time));
    if (progress && !progress(i + 1, simulator.size())) return false;
  }
  writer.commit();
  return true;
}

}  // namespace dynains::simulation
