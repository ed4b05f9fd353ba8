#include "dynains/simulation/write_log.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "io/log/cdr_writer.hpp"
#include "io/log/mcap_writer.hpp"

namespace dynains::simulation {
namespace {

constexpr const char* kFrame = "lidar";

const std::string kSeparator = std::string(80, '=') + '\n';
const std::string kHeaderDefinition =
    kSeparator + "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" +
    kSeparator + "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const std::string kCloudDefinition =
    "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n"
    "bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n" +
    kSeparator +
    "MSG: sensor_msgs/PointField\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n" +
    kHeaderDefinition;
const std::string kTransformsDefinition =
    "geometry_msgs/TransformStamped[] transforms\n" + kSeparator +
    "MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\n"
    "geometry_msgs/Transform transform\n" +
    kSeparator +
    "MSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\n"
    "geometry_msgs/Quaternion rotation\n" +
    kSeparator + "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n" + kSeparator +
    "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n" +
    kHeaderDefinition;

std::string cloud_of(const SimulatedScan& scan, std::uint64_t time) {
  struct Field {
    const char* name;
    std::uint8_t datatype;  // of sensor_msgs/PointField
  };
  constexpr std::uint8_t kUint32 = 6;
  constexpr std::uint8_t kFloat32 = 7;
  std::vector<Field> fields = {{"x", kFloat32},
                               {"y", kFloat32},
                               {"z", kFloat32},
                               {"intensity", kFloat32},
                               {"label", kUint32}};
  const bool has_times = !scan.times.empty();
  if (has_times) fields.push_back({"time", kFloat32});
  constexpr std::uint32_t kSize = 4;  // bytes of each field
  const auto field_count = static_cast<std::uint32_t>(fields.size());
  const std::uint32_t step = kSize * field_count;
  const auto points = static_cast<std::uint32_t>(scan.labels.size());
  CdrWriter out;
  out.header(time, kFrame);
  out.number(std::uint32_t{1});  // height
  out.number(points);
  out.number(field_count);
  std::uint32_t offset = 0;
  for (const Field& field : fields) {
    out.string(field.name);
    out.number(offset);
    out.number(field.datatype);
    out.number(std::uint32_t{1});  // count
    offset += kSize;
  }
  out.number(std::uint8_t{0});  // little endian
  out.number(step);
  out.number(step * points);
  out.number(step * points);
  for (std::uint32_t i = 0; i < points; ++i) {
    for (std::uint32_t k = 0; k < 4; ++k) out.number(scan.xyzi[4 * std::size_t{i} + k]);
    out.number(scan.labels[i]);
    if (has_times) out.number(scan.times[i]);
  }
  out.number(std::uint8_t{1});  // dense
  return out.bytes();
}

std::string transform_of(const Eigen::Isometry3d& T_map_lidar, std::uint64_t time) {
  CdrWriter out;
  out.number(std::uint32_t{1});
  out.header(time, "map");
  out.string(kFrame);
  for (const double value : Eigen::Vector3d(T_map_lidar.translation())) out.number(value);
  const Eigen::Quaterniond rotation(T_map_lidar.linear());
  for (const double value : Eigen::Vector4d(rotation.coeffs())) out.number(value);
  return out.bytes();
}

}  // namespace

bool write_log(Simulator& simulator, const std::filesystem::path& file,
               const std::function<bool(std::size_t, std::size_t)>& progress) {
  McapWriter writer(file);
  const std::uint16_t clouds =
      writer.add_channel("/points", "sensor_msgs/msg/PointCloud2", kCloudDefinition);
  const std::uint16_t transforms =
      writer.add_channel("/tf", "tf2_msgs/msg/TFMessage", kTransformsDefinition);
  for (std::size_t i = 0; i < simulator.size(); ++i) {
    const SimulatedScan scan = simulator.scan(i);
    const auto time = static_cast<std::uint64_t>(std::llround(scan.time * 1e9));
    writer.write(transforms, time, transform_of(scan.T_world_sensor_noisy, time));
    writer.write(clouds, time, cloud_of(scan, time));
    if (progress && !progress(i + 1, simulator.size())) return false;
  }
  writer.commit();
  return true;
}

}  // namespace dynains::simulation
