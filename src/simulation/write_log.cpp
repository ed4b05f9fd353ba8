#include <cmath>
#include <cstdint>
#include <string>

#include "io/logs/mcap_writer.hpp"
#include "io/logs/message_writer.hpp"
#include "io/scalar.hpp"
#include "simulation/write_sequence.hpp"

namespace dynains::simulation {
namespace {

std::string cloud_of(const SimulatedScan& scan, std::uint64_t time) {
  CloudLayout layout{{{"x", Scalar::kFloat},
                      {"y", Scalar::kFloat},
                      {"z", Scalar::kFloat},
                      {"intensity", Scalar::kFloat},
                      {"label", Scalar::kUint32}}};
  const bool has_times = !scan.times.empty();
  if (has_times) layout.fields.push_back({"time", Scalar::kFloat});
  std::string points;
  points.reserve(scan.labels.size() * layout.point_size());
  for (std::size_t i = 0; i < scan.labels.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k) append_number(scan.xyzi[4 * i + k], points);
    append_number(scan.labels[i], points);
    if (has_times) append_number(scan.times[i], points);
  }
  return cloud_message(time, "lidar", layout, points);
}

}  // namespace

bool write_log(Simulator& simulator, const std::filesystem::path& file,
               const std::function<bool(std::size_t, std::size_t)>& progress) {
  McapWriter writer(file);
  const std::uint16_t clouds = writer.add_channel(cloud_topic("/points"));
  const std::uint16_t transforms = writer.add_channel(transforms_topic("/tf"));
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
