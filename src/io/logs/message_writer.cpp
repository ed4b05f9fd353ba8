#include "message_writer.hpp"

namespace dynains {
namespace {

constexpr const char* kCloudType = "sensor_msgs/msg/PointCloud2";
constexpr const char* kTransformsType = "tf2_msgs/msg/TFMessage";

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

LogTopic ros2_topic(const std::string& name, const char* type) {
  LogTopic topic;
  topic.name = name;
  topic.type = plain_type(type);
  topic.encoding = MessageEncoding::kCdr;
  topic.message_encoding = "cdr";
  topic.schema = ros2_schema(type);
  return topic;
}

}  // namespace

std::shared_ptr<const LogSchema> ros2_schema(const std::string& name) {
  const std::string definition = name == kCloudType        ? cloud_definition()
                                 : name == kTransformsType ? transforms_definition()
                                                           : std::string();
  return std::make_shared<LogSchema>(
      LogSchema{name, definition.empty() ? "" : "ros2msg", definition});
}

LogTopic cloud_topic(const std::string& name) { return ros2_topic(name, kCloudType); }
LogTopic transforms_topic(const std::string& name) { return ros2_topic(name, kTransformsType); }

}  // namespace dynains
