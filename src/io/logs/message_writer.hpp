// Fields of a message of ROS, in order.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
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
    if (is_ros1_) number(std::uint32_t{0});  // sequence number
    number(static_cast<std::uint32_t>(time / kSecondOfLog));
    number(static_cast<std::uint32_t>(time % kSecondOfLog));
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

/// Types of fields; the datatype of sensor_msgs/PointField is the index plus 1.
inline constexpr Scalar kFieldTypes[] = {Scalar::kInt8,   Scalar::kUint8, Scalar::kInt16,
                                         Scalar::kUint16, Scalar::kInt32, Scalar::kUint32,
                                         Scalar::kFloat,  Scalar::kDouble};
inline std::uint8_t datatype_of(Scalar type) {
  const auto* const found = std::find(std::begin(kFieldTypes), std::end(kFieldTypes), type);
  return static_cast<std::uint8_t>(found - std::begin(kFieldTypes) + 1);
}

/// Fields of packed points.
struct CloudLayout {
  struct Field {
    const char* name;
    Scalar type;
  };

  std::vector<Field> fields;

  std::uint32_t point_size() const {
    std::size_t size = 0;
    for (const Field& field : fields) size += size_of(field.type);
    return static_cast<std::uint32_t>(size);
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
    out.number(datatype_of(field.type));
    out.number(std::uint32_t{1});  // count
    offset += static_cast<std::uint32_t>(size_of(field.type));
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
