// Serialised messages of ROS for tests.
#pragma once

#include "io/files.hpp"
#include "io/logs/message_fields.hpp"
#include "io/logs/ros_messages.hpp"
#include "support/standard.hpp"

namespace dynains::test {

inline std::uint64_t nanoseconds(double time) {
  return static_cast<std::uint64_t>(std::llround(time * 1e9));
}

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
  MessageWriter out(encoding);
  out.header(nanoseconds(time), frame).number(std::uint32_t{1}).number(points);
  out.number(static_cast<std::uint32_t>(fields.size()));
  for (const CloudField& field : fields) {
    out.string(field.name).number(field.offset).number(field.type).number(field.count);
  }
  out.number(std::uint8_t{0}).number(point_step).number(points * point_step);
  out.number(static_cast<std::uint32_t>(data.size())).raw(data).number(std::uint8_t{1});
  return out.bytes();
}

inline const std::vector<CloudField> kXyz = {{"x", 0, 7}, {"y", 4, 7}, {"z", 8, 7}};

inline Eigen::Isometry3d pose_at(double x, double yaw) {
  return Eigen::Translation3d(x, 1, 2) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
}

inline std::string odometry(double time, const std::string& child, const Eigen::Isometry3d& T,
                            MessageEncoding encoding = MessageEncoding::kCdr) {
  return MessageWriter(encoding).header(nanoseconds(time), "odom").string(child).pose(T).bytes();
}

inline std::string transform(double time, const std::string& parent, const std::string& child,
                             const Eigen::Isometry3d& T,
                             MessageEncoding encoding = MessageEncoding::kCdr) {
  return MessageWriter(encoding)
      .number(std::uint32_t{1})
      .header(nanoseconds(time), parent)
      .string(child)
      .pose(T)
      .bytes();
}

inline std::string small_cloud(double time, const std::string& frame,
                               MessageEncoding encoding = MessageEncoding::kCdr) {
  return cloud_message(encoding, time, frame, kXyz, 12, bytes_of<float>({1, 2, 3, 4, 5, 6}));
}

}  // namespace dynains::test
