#include "ros_messages.hpp"

#include <algorithm>
#include <iterator>

#include "../poses/kitti_files.hpp"
#include "message_cloud.hpp"
#include "message_fields.hpp"

namespace dynains {
namespace {

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

/// A pose behind a header and, with a child, the name of its frame.
StampedPose read_stamped(MessageReader& in, bool has_child) {
  const MessageHeader header = in.header();
  std::string child = has_child ? in.frame("a child frame id") : std::string();
  return {header.time, header.frame, std::move(child), read_pose(in)};
}

/// The definition of a type within that of another one.
std::string part(const char* type, const char* fields) {
  return std::string(80, '=') + "\nMSG: " + type + '\n' + fields;
}

std::string header() {
  return part("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n") +
         part("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
}

std::string cloud_definition() {
  return "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n"
         "bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n" +
         part("sensor_msgs/PointField",
              "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\n"
              "uint8 UINT32=6\nuint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\n"
              "uint8 datatype\nuint32 count\n") +
         header();
}

std::string transforms_definition() {
  return "geometry_msgs/TransformStamped[] transforms\n" +
         part(
             "geometry_msgs/TransformStamped",
             "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n") +
         part("geometry_msgs/Transform",
              "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n") +
         part("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n") +
         part("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n") +
         header();
}

}  // namespace

bool is_cloud_type(const std::string& type) { return type == kPointCloud2 || is_livox(type); }

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
  const MessageCloud cloud(type, message);
  return {cloud.header().time, cloud.header().frame, cloud.size(), cloud.columns()};
}

void read_cloud(const std::string& type, const SerialisedMessage& message, RecordedScan& scan) {
  const MessageCloud cloud(type, message);
  const MessageCloud::Field &ring = cloud.field(Role::kRing), &time = cloud.field(Role::kTime),
                            &sensor = cloud.field(Role::kSensor);
  scan.xyzi.resize(4 * cloud.size());
  scan.ring.resize(ring.is_there ? cloud.size() : 0);
  scan.time.resize(time.is_there ? cloud.size() : 0);
  scan.sensor.assign(sensor.is_there || cloud.sensor() ? cloud.size() : 0,
                     cloud.sensor().value_or(0));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const std::uint8_t* const point = cloud.point(i);
    float* const xyzi = scan.xyzi.data() + 4 * i;
    for (std::size_t k = 0; k < std::size(kUsualRoles); ++k) {
      const MessageCloud::Field& field = cloud.field(kUsualRoles[k]);
      xyzi[k] = field.is_there ? to_float(field.value(point)) : 0.0F;
    }
    if (ring.is_there) scan.ring[i] = ring_number(ring.value(point));
    if (time.is_there) scan.time[i] = time.value(point);
    if (sensor.is_there) scan.sensor[i] = sensor_number(sensor.value(point));
  }
}

std::vector<std::uint32_t> read_cloud_labels(const std::string& type,
                                             const SerialisedMessage& message) {
  const MessageCloud cloud(type, message);
  if (is_livox(type)) cloud.fail("expected a field \"label\", which CustomMsg cannot have");
  const MessageCloud::Field& label_field = cloud.field(Role::kLabel);
  if (!label_field.is_there) cloud.fail("expected a field \"label\", as in the first cloud");
  std::vector<std::uint32_t> labels(cloud.size());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const double label = label_field.value(cloud.point(i));
    if (!(label >= 0.0 && label < 4294967296.0)) cloud.fail("expected labels from 0 to 4294967295");
    labels[i] = static_cast<std::uint32_t>(label);
  }
  return labels;
}

Concatenation read_concatenation(const SerialisedMessage& message) {
  MessageReader in(message);
  Concatenation result;
  result.time = in.header().time;
  in.take(2, "a success and a strategy");
  in.take(in.length(1, "a configuration"), "a configuration");
  result.parts.resize(in.length(25, "sources"));  // bytes of the smallest one
  for (Concatenation::Part& part : result.parts) {
    part.frame = in.header().frame;
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
    for (std::uint32_t i = 0; i < count; ++i) poses.push_back(read_stamped(in, true));
  } else {
    const bool has_child = type == "nav_msgs/Odometry" || type == "geometry_msgs/TransformStamped";
    poses.push_back(read_stamped(in, has_child));
  }
  return poses;
}

std::shared_ptr<const LogSchema> ros2_schema(const std::string& name) {
  const std::string definition = name == kCloudTopicType        ? cloud_definition()
                                 : name == kTransformsTopicType ? transforms_definition()
                                                                : std::string();
  return std::make_shared<LogSchema>(
      LogSchema{name, definition.empty() ? "" : "ros2msg", definition});
}

LogTopic ros2_topic(const std::string& name, const std::string& type) {
  LogTopic topic;
  topic.name = name;
  topic.type = plain_type(type);
  topic.encoding = MessageEncoding::kCdr;
  topic.message_encoding = "cdr";
  topic.schema = ros2_schema(type);
  return topic;
}

}  // namespace dynains
