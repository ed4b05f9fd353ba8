// Serialised messages of ROS for tests.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "io/logs/ros_messages.hpp"

namespace dynains::test {

/// Bytes of numbers and texts, little-endian.
class ByteWriter {
 public:
  template <class Number>
  ByteWriter& number(Number value) {
    char bytes[sizeof(value)];
    std::memcpy(bytes, &value, sizeof(value));
    text_.append(bytes, sizeof(value));
    return *this;
  }
  ByteWriter& raw(const std::string& bytes) {
    text_ += bytes;
    return *this;
  }
  /// Length and bytes.
  ByteWriter& string(const std::string& text) {
    number(static_cast<std::uint32_t>(text.size()));
    return raw(text);
  }
  std::size_t size() const { return text_.size(); }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

/// Serialises the fields of a message as ROS 1 or ROS 2 does.
class FieldWriter {
 public:
  explicit FieldWriter(MessageEncoding encoding) : is_ros1_(encoding == MessageEncoding::kRos1) {
    if (!is_ros1_) bytes_.raw(std::string("\0\1\0\0", 4));
  }
  template <class Number>
  FieldWriter& number(Number value) {
    while (!is_ros1_ && (bytes_.size() - 4) % sizeof(value) != 0) bytes_.raw(std::string(1, '\0'));
    bytes_.number(value);
    return *this;
  }
  FieldWriter& string(const std::string& text) {
    const std::string ended = is_ros1_ ? text : text + std::string(1, '\0');
    number(static_cast<std::uint32_t>(ended.size()));
    bytes_.raw(ended);
    return *this;
  }
  FieldWriter& raw(const std::string& bytes) {
    bytes_.raw(bytes);
    return *this;
  }
  FieldWriter& header(double time, const std::string& frame) {
    if (is_ros1_) number(std::uint32_t{7});
    const auto seconds = static_cast<std::int32_t>(time);
    number(seconds);
    number(static_cast<std::uint32_t>((time - seconds) * 1e9 + 0.5));
    return string(frame);
  }
  FieldWriter& pose(const Eigen::Isometry3d& T) {
    for (int i = 0; i < 3; ++i) number(T.translation()[i]);
    const Eigen::Quaterniond q(T.rotation());
    for (const double value : {q.x(), q.y(), q.z(), q.w()}) number(value);
    return *this;
  }
  const std::string& text() const { return bytes_.text(); }

 private:
  bool is_ros1_;
  ByteWriter bytes_;
};

struct CloudField {
  std::string name;
  std::uint32_t offset;
  std::uint8_t type;
  std::uint32_t count = 1;
};

/// sensor_msgs/PointCloud2 with one row of points.
inline std::string cloud_message(MessageEncoding encoding, double time, const std::string& frame,
                                 const std::vector<CloudField>& fields, std::uint32_t point_step,
                                 const std::string& data) {
  const auto points = static_cast<std::uint32_t>(data.size() / point_step);
  FieldWriter out(encoding);
  out.header(time, frame).number(std::uint32_t{1}).number(points);
  out.number(static_cast<std::uint32_t>(fields.size()));
  for (const CloudField& field : fields) {
    out.string(field.name).number(field.offset).number(field.type).number(field.count);
  }
  out.number(std::uint8_t{0}).number(point_step).number(points * point_step);
  out.number(static_cast<std::uint32_t>(data.size())).raw(data).number(std::uint8_t{1});
  return out.text();
}

inline const std::vector<CloudField> kXyz = {{"x", 0, 7}, {"y", 4, 7}, {"z", 8, 7}};

inline std::string xyz_of(const std::vector<float>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)};
}

inline Eigen::Isometry3d pose_at(double x, double yaw) {
  return Eigen::Translation3d(x, 1, 2) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
}

inline std::string odometry(double time, const std::string& child, const Eigen::Isometry3d& T,
                            MessageEncoding encoding = MessageEncoding::kCdr) {
  return FieldWriter(encoding).header(time, "odom").string(child).pose(T).text();
}

inline std::string transform(double time, const std::string& parent, const std::string& child,
                             const Eigen::Isometry3d& T,
                             MessageEncoding encoding = MessageEncoding::kCdr) {
  return FieldWriter(encoding)
      .number(std::uint32_t{1})
      .header(time, parent)
      .string(child)
      .pose(T)
      .text();
}

inline std::string small_cloud(double time, const std::string& frame,
                               MessageEncoding encoding = MessageEncoding::kCdr) {
  return cloud_message(encoding, time, frame, kXyz, 12, xyz_of({1, 2, 3, 4, 5, 6}));
}

inline std::uint64_t nanoseconds(double time) { return static_cast<std::uint64_t>(time * 1e9); }

}  // namespace dynains::test
