#include "ros_messages.hpp"

#include <algorithm>
#include <iterator>

#include "../poses/kitti_files.hpp"
#include "message_reader.hpp"
#include "point_cloud2.hpp"

namespace dynains {
namespace {

struct Header {
  double time = 0.0;  // s
  std::string frame;
};

double read_stamp(MessageReader& in) {
  // ROS 1 has an unsigned and ROS 2 a signed number of seconds.
  const double seconds = in.is_ros1() ? static_cast<double>(in.number<std::uint32_t>("seconds"))
                                      : static_cast<double>(in.number<std::int32_t>("seconds"));
  return seconds + 1e-9 * static_cast<double>(in.number<std::uint32_t>("nanoseconds"));
}

/// Names of frames in old bags begin with a slash.
std::string read_frame(MessageReader& in, const char* purpose) {
  std::string frame = in.string(purpose);
  if (!frame.empty() && frame.front() == '/') frame.erase(0, 1);
  return frame;
}

Header read_header(MessageReader& in) {
  Header header;
  if (in.is_ros1()) in.number<std::uint32_t>("a sequence number");
  header.time = read_stamp(in);
  header.frame = read_frame(in, "a frame id");
  return header;
}

/// Position and quaternion, as in geometry_msgs/Pose and geometry_msgs/Transform.
Pose read_pose(MessageReader& in) {
  Eigen::Vector3d position;
  for (double& value : position) value = in.number<double>("a position");
  Eigen::Vector4d xyzw;
  for (double& value : xyzw) value = in.number<double>("a quaternion");
  const auto pose = rigid_pose(position, detail::Quaternion(xyzw));
  if (!pose) in.fail("expected a finite position and a quaternion of length 1");
  return *pose;
}

StampedPose read_transform(MessageReader& in) {
  const Header header = read_header(in);
  std::string child = read_frame(in, "a child frame id");
  return {header.time, header.frame, std::move(child), read_pose(in)};
}

std::uint16_t ring_of(double value) {
  return value >= 0.0 && value <= 65535.0 ? static_cast<std::uint16_t>(value) : std::uint16_t{0};
}

void resize(RecordedScan& scan, std::size_t points, const PointColumns& columns) {
  scan.xyzi.resize(4 * points);
  scan.ring.resize(columns.ring ? points : 0);
  scan.time.resize(columns.time ? points : 0);
}

void read_point_cloud2(MessageReader& in, RecordedScan& scan) {
  const PointCloud2 cloud(in);
  resize(scan, cloud.size(), cloud.columns());
  const PointCloud2::Field& sensor = cloud.field(Role::kSensor);
  scan.sensor.resize(sensor.is_there ? cloud.size() : 0);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const std::uint8_t* const point = cloud.point(i);
    float* const xyzi = scan.xyzi.data() + 4 * i;
    for (std::size_t k = 0; k < std::size(kUsualRoles); ++k) {
      const PointCloud2::Field& field = cloud.field(kUsualRoles[k]);
      xyzi[k] = field.is_there ? static_cast<float>(field.value(point)) : 0.0F;
    }
    const PointCloud2::Field &ring = cloud.field(Role::kRing), &time = cloud.field(Role::kTime);
    if (ring.is_there) scan.ring[i] = ring_of(ring.value(point));
    if (time.is_there) scan.time[i] = time.value(point);
    if (sensor.is_there) scan.sensor[i] = sensor_number(sensor.value(point));
  }
}

PointColumns livox_columns() {
  PointColumns columns;
  columns.intensity = true;
  columns.ring = true;
  columns.time = true;
  return columns;
}

struct LivoxCloud {
  std::uint8_t lidar = 0;
  std::uint32_t points = 0;
};

/// The part of a CustomMsg behind its header: the number of points is checked against its size.
LivoxCloud read_livox_cloud(MessageReader& in) {
  LivoxCloud cloud;
  in.number<std::uint64_t>("a time base");
  in.number<std::uint32_t>("a number of points");
  cloud.lidar = in.number<std::uint8_t>("a lidar id");
  in.take(3, "reserved bytes");
  cloud.points = in.length(kLivoxPoint, "points");
  return cloud;
}

void read_livox(MessageReader& in, RecordedScan& scan) {
  const auto [lidar, points] = read_livox_cloud(in);
  scan.sensor.assign(points, lidar);
  resize(scan, points, livox_columns());
  for (std::uint32_t i = 0; i < points; ++i) {
    scan.time[i] = in.number<std::uint32_t>("an offset time");
    float* const xyzi = scan.xyzi.data() + 4 * std::size_t{i};
    for (int axis = 0; axis < 3; ++axis) xyzi[axis] = in.number<float>("a coordinate");
    xyzi[3] = static_cast<float>(in.number<std::uint8_t>("a reflectivity"));
    in.number<std::uint8_t>("a tag");
    scan.ring[i] = in.number<std::uint8_t>("a line");
  }
}

bool is_livox(const std::string& type) {
  return type == "livox_ros_driver/CustomMsg" || type == "livox_ros_driver2/CustomMsg" ||
         type == "livox_interfaces/CustomMsg";
}

}  // namespace

bool is_cloud_type(const std::string& type) {
  return type == "sensor_msgs/PointCloud2" || is_livox(type);
}

bool is_transform_type(const std::string& type) {
  return type == "tf2_msgs/TFMessage" || type == "tf/tfMessage";
}

bool is_concatenation_type(const std::string& type) {
  return type == "autoware_sensing_msgs/ConcatenatedPointCloudInfo";
}

bool is_pose_type(const std::string& type) {
  static constexpr const char* kTypes[] = {
      "nav_msgs/Odometry",
      "geometry_msgs/PoseStamped",
      "geometry_msgs/PoseWithCovarianceStamped",
      "geometry_msgs/TransformStamped",
  };
  return is_transform_type(type) ||
         std::find(std::begin(kTypes), std::end(kTypes), type) != std::end(kTypes);
}

CloudInfo inspect_cloud(const std::string& type, const SerialisedMessage& message) {
  MessageReader in(message);
  const Header header = read_header(in);
  if (is_livox(type)) {
    return {header.time, header.frame, read_livox_cloud(in).points, livox_columns()};
  }
  const PointCloud2 cloud(in);
  return {header.time, header.frame, cloud.size(), cloud.columns()};
}

void read_cloud(const std::string& type, const SerialisedMessage& message, RecordedScan& scan) {
  MessageReader in(message);
  read_header(in);
  is_livox(type) ? read_livox(in, scan) : read_point_cloud2(in, scan);
}

std::vector<std::uint32_t> read_cloud_labels(const std::string& type,
                                             const SerialisedMessage& message) {
  MessageReader in(message);
  read_header(in);
  if (is_livox(type)) in.fail("expected a field \"label\", which CustomMsg cannot have");
  const PointCloud2 cloud(in);
  const PointCloud2::Field& label_field = cloud.field(Role::kLabel);
  if (!label_field.is_there) in.fail("expected a field \"label\", as in the first cloud");
  std::vector<std::uint32_t> labels(cloud.size());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const double label = label_field.value(cloud.point(i));
    if (!(label >= 0.0 && label < 4294967296.0)) in.fail("expected labels from 0 to 4294967295");
    labels[i] = static_cast<std::uint32_t>(label);
  }
  return labels;
}

Concatenation read_concatenation(const SerialisedMessage& message) {
  MessageReader in(message);
  Concatenation result;
  result.time = read_header(in).time;
  in.take(2, "a success and a strategy");
  in.take(in.length(1, "a configuration"), "a configuration");
  result.parts.resize(in.length(25, "sources"));  // bytes of the smallest one
  for (Concatenation::Part& part : result.parts) {
    part.frame = read_header(in).frame;
    in.string("a topic");
    in.number<std::uint8_t>("a status");
    part.begin = in.number<std::uint32_t>("a begin");
    part.length = in.number<std::uint32_t>("a length");
  }
  return result;
}

std::vector<StampedPose> read_poses(const std::string& type, const SerialisedMessage& message) {
  MessageReader in(message);
  std::vector<StampedPose> poses;
  if (is_transform_type(type)) {
    const std::uint32_t count = in.length(72, "transforms");  // bytes of the smallest one
    for (std::uint32_t i = 0; i < count; ++i) poses.push_back(read_transform(in));
  } else if (type == "geometry_msgs/TransformStamped") {
    poses.push_back(read_transform(in));
  } else {
    const Header header = read_header(in);
    std::string child;
    if (type == "nav_msgs/Odometry") child = read_frame(in, "a child frame id");
    poses.push_back({header.time, header.frame, std::move(child), read_pose(in)});
  }
  return poses;
}

}  // namespace dynains
