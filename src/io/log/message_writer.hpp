// Fields of a message of ROS, in order.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "../scalar.hpp"
#include "dynains/pose.hpp"
#include "log_file.hpp"

namespace dynains {

/// Serialises as ROS 1 does, or by CDR (little endian), where numbers are aligned to their size.
class MessageWriter {
 public:
  explicit MessageWriter(MessageEncoding encoding) : is_ros1_(encoding == MessageEncoding::kRos1) {
    if (!is_ros1_) bytes_.assign("\0\1\0\0", kCdrHeader);
  }

  template <class Number>
  void number(Number value) {
    while (!is_ros1_ && (bytes_.size() - kCdrHeader) % sizeof(value) != 0) bytes_.push_back('\0');
    append_number(value, bytes_);
  }
  void string(const std::string& text) {
    const std::size_t end = is_ros1_ ? 0 : 1;
    number(static_cast<std::uint32_t>(text.size() + end));
    bytes_.append(text.c_str(), text.size() + end);
  }
  /// std_msgs/Header; `time`: ns.
  void header(std::uint64_t time, const std::string& frame) {
    constexpr std::uint64_t kSecond = 1000000000;
    if (is_ros1_) number(std::uint32_t{0});  // sequence number
    number(static_cast<std::uint32_t>(time / kSecond));
    number(static_cast<std::uint32_t>(time % kSecond));
    string(frame);
  }
  void bytes(const std::string& values) { bytes_ += values; }
  const std::string& bytes() const { return bytes_; }

 private:
  static constexpr std::size_t kCdrHeader = 4;  // bytes
  bool is_ros1_;
  std::string bytes_;
};

/// tf2_msgs/msg/TFMessage with one transform; `time`: ns.
inline std::string transform_message(std::uint64_t time, const std::string& parent,
                                     const std::string& child, const Pose& T_parent_child) {
  MessageWriter out(MessageEncoding::kCdr);
  out.number(std::uint32_t{1});
  out.header(time, parent);
  out.string(child);
  for (const double value : Eigen::Vector3d(T_parent_child.translation())) out.number(value);
  const detail::Quaternion rotation(T_parent_child.linear());
  for (const double value : Eigen::Vector4d(rotation.coeffs())) out.number(value);
  return out.bytes();
}

/// Fields of packed points.
struct CloudLayout {
  struct Field {
    const char* name;
    std::uint8_t datatype;  ///< of sensor_msgs/PointField
    std::uint8_t size;      ///< bytes
  };
  static constexpr std::uint8_t kUint8 = 2;
  static constexpr std::uint8_t kUint16 = 4;
  static constexpr std::uint8_t kUint32 = 6;
  static constexpr std::uint8_t kFloat32 = 7;
  static constexpr std::uint8_t kFloat64 = 8;

  std::vector<Field> fields;

  std::uint32_t point_size() const {
    std::uint32_t size = 0;
    for (const Field& field : fields) size += field.size;
    return size;
  }
};

/// sensor_msgs/msg/PointCloud2 with one row; `points`: packed as in the layout; `time`: ns.
inline std::string cloud_message(std::uint64_t time, const std::string& frame,
                                 const CloudLayout& layout, const std::string& points) {
  const std::uint32_t step = layout.point_size();
  const auto size = static_cast<std::uint32_t>(points.size());
  MessageWriter out(MessageEncoding::kCdr);
  out.header(time, frame);
  out.number(std::uint32_t{1});  // height
  out.number(size / step);
  out.number(static_cast<std::uint32_t>(layout.fields.size()));
  std::uint32_t offset = 0;
  for (const CloudLayout::Field& field : layout.fields) {
    out.string(field.name);
    out.number(offset);
    out.number(field.datatype);
    out.number(std::uint32_t{1});  // count
    offset += field.size;
  }
  out.number(std::uint8_t{0});  // little endian
  out.number(step);
  out.number(size);
  out.number(size);
  out.bytes(points);
  out.number(std::uint8_t{1});  // dense
  return out.bytes();
}

}  // namespace dynains
