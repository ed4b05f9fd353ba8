// A recording of a rig as its robot records it: one topic for each sensor, with its own clock.
#pragma once

#include "dynains/io/recording.hpp"
#include "io/files.hpp"
#include "io/log_writer.hpp"
#include "support/standard.hpp"

namespace dynains::test {

/// Writes the points of sensor k of `rig` to topic /lidar<k>, in frame lidar<k> at
/// `delays[k]` (s) after the stamp of their scan, where they were measured. `T_body_sensor` is what
/// the log says about the sensors.
inline void write_rig_log(const Recording& rig, const std::vector<double>& delays,
                          const std::vector<Pose>& T_body_sensor,
                          const std::filesystem::path& file) {
  std::vector<LogChannel> channels = {kTf, kStaticTf};
  std::vector<WrittenMessage> messages;
  for (std::size_t k = 0; k < delays.size(); ++k) {
    const std::string name = "lidar" + std::to_string(k);
    channels.push_back({"/" + name, kClouds.type});
    messages.push_back(transform_at(1, 0.0, "base", name, T_body_sensor[k]));
  }
  const std::vector<CloudField> fields = xyz_and({{"label", 12, 6}});
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const Pose& T_world_body = rig.T_world_sensor(i);
    messages.push_back(transform_at(0, rig.time(i), "odom", "base", T_world_body));
    if (i + 1 == rig.size()) break;  // for its motion
    const RecordedScan scan = rig.read_scan(i);
    const std::vector<std::uint32_t> labels = rig.read_labels(i);
    const double period = rig.time(i + 1) - rig.time(i);
    for (std::size_t k = 0; k < delays.size(); ++k) {
      const Pose T_world_then =
          interpolate(T_world_body, rig.T_world_sensor(i + 1), delays[k] / period);
      const Pose T_sensor_body = rig.sensors()[k].inverse() * T_world_then.inverse() * T_world_body;
      std::string points;
      for (std::size_t p = 0; p < scan.size(); ++p) {
        if (scan.sensor[p] != k) continue;
        const Eigen::Vector3f xyz(scan.xyzi.data() + 4 * p);
        const Eigen::Vector3f measured = (T_sensor_body * xyz.cast<double>()).cast<float>();
        points += packed(measured.x(), measured.y(), measured.z(), labels[p]);
      }
      const double time = rig.time(i) + delays[k];
      messages.push_back({static_cast<std::uint16_t>(2 + k), nanoseconds(time),
                          cloud_message(MessageEncoding::kCdr, time, "lidar" + std::to_string(k),
                                        fields, 16, points)});
    }
  }
  write_text(file, mcap_file(channels, messages, {}));
}

}  // namespace dynains::test
