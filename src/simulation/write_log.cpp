#include "dynains/simulation/write_log.hpp"

#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "io/log/log_writer.hpp"
#include "io/log/message_writer.hpp"
#include "io/scalar.hpp"

namespace dynains::simulation {
namespace {

constexpr const char* kFrame = "lidar";

std::string cloud_of(const SimulatedScan& scan, MessageEncoding encoding, std::uint64_t time) {
  CloudLayout layout{{{"x", CloudLayout::kFloat32, 4},
                      {"y", CloudLayout::kFloat32, 4},
                      {"z", CloudLayout::kFloat32, 4},
                      {"intensity", CloudLayout::kFloat32, 4},
                      {"label", CloudLayout::kUint32, 4}}};
  const bool has_times = !scan.times.empty();
  if (has_times) layout.fields.push_back({"time", CloudLayout::kFloat32, 4});
  std::string points;
  points.reserve(scan.labels.size() * layout.point_size());
  for (std::size_t i = 0; i < scan.labels.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k) append_number(scan.xyzi[4 * i + k], points);
    append_number(scan.labels[i], points);
    if (has_times) append_number(scan.times[i], points);
  }
  return cloud_message(encoding, time, kFrame, layout, points);
}

}  // namespace

bool write_log(Simulator& simulator, const std::filesystem::path& file,
               const std::function<bool(std::size_t, std::size_t)>& progress) {
  const std::unique_ptr<LogWriter> writer = create_log(file);
  const MessageEncoding encoding = writer->encoding();
  // ROS 1 takes time 0 for a time that is not known.
  const double begin = encoding == MessageEncoding::kRos1 ? 1.0 : 0.0;  // s
  const std::uint16_t clouds = writer->add_channel("/points", point_cloud2_type());
  const std::uint16_t transforms = writer->add_channel("/tf", transforms_type());
  for (std::size_t i = 0; i < simulator.size(); ++i) {
    const SimulatedScan scan = simulator.scan(i);
    const auto time = static_cast<std::uint64_t>(std::llround((begin + scan.time) * 1e9));
    writer->write(transforms, time,
                  transform_message(encoding, time, "map", kFrame, scan.T_world_sensor_noisy));
    writer->write(clouds, time, cloud_of(scan, encoding, time));
    if (progress && !progress(i + 1, simulator.size())) return false;
  }
  writer->commit();
  return true;
}

}  // namespace dynains::simulation
