#include "message_types.hpp"

namespace dynains {
namespace {

const std::string& separator() {
  static const std::string text = std::string(80, '=') + '\n';
  return text;
}

}  // namespace

std::string MessageType::ros2_name() const {
  const std::size_t slash = name.find('/');
  return name.substr(0, slash) + "/msg" + name.substr(slash);
}

std::string MessageType::definition(MessageEncoding encoding) const {
  const std::string header = separator() + "MSG: std_msgs/Header\n";
  if (encoding == MessageEncoding::kRos1) {
    return body + header + "uint32 seq\ntime stamp\nstring frame_id\n";
  }
  return body + header + "builtin_interfaces/Time stamp\nstring frame_id\n" + separator() +
         "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
}

const MessageType& point_cloud2_type() {
  static const MessageType type = {
      "sensor_msgs/PointCloud2", "1158d486dd51d683ce2f1be655c3c181",
      "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n"
      "bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n" +
          separator() +
          "MSG: sensor_msgs/PointField\nuint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\n"
          "uint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\nuint8 FLOAT32=7\nuint8 FLOAT64=8\n"
          "string name\nuint32 offset\nuint8 datatype\nuint32 count\n"};
  return type;
}

const MessageType& transforms_type() {
  static const MessageType type = {
      "tf2_msgs/TFMessage", "94810edda583a504dfda3829e70d7eec",
      "geometry_msgs/TransformStamped[] transforms\n" + separator() +
          "MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\n"
          "geometry_msgs/Transform transform\n" +
          separator() +
          "MSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\n"
          "geometry_msgs/Quaternion rotation\n" +
          separator() + "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n" +
          separator() + "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\n" +
          "float64 w\n"};
  return type;
}

}  // namespace dynains
