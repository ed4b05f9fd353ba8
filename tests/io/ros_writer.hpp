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

/// Size and order of the data of a cloud.
struct CloudShape {
  std::uint32_t rows, columns, point_step, row_step;
  std::uint8_t is_big_endian = 0;
};

/// sensor_msgs/PointCloud2, with whatever its data has.
inline std::string cloud_message(MessageEncoding encoding, double time, const std::string& frame,
                                 const std::vector<CloudField>& fields, const CloudShape& shape,
                                 const std::string& data) {
  MessageWriter out(encoding);
  out.header(nanoseconds(time), frame).number(shape.rows).number(shape.columns);
  out.number(static_cast<std::uint32_t>(fields.size()));
  for (const CloudField& field : fields) {
    out.string(field.name).number(field.offset).number(field.type).number(field.count);
  }
  out.number(shape.is_big_endian).number(shape.point_step).number(shape.row_step);
  out.number(static_cast<std::uint32_t>(data.size())).raw(data).number(std::uint8_t{1});
  return out.bytes();
}

/// With one row of points.
inline std::string cloud_message(MessageEncoding encoding, double time, const std::string& frame,
                                 const std::vector<CloudField>& fields, std::uint32_t point_step,
                                 const std::string& data) {
  const auto points = static_cast<std::uint32_t>(data.size() / point_step);
  return cloud_message(encoding, time, frame, fields, {1, points, point_step, points * point_step},
                       data);
}

inline const std::vector<CloudField> kXyz = {{"x", 0, 7}, {"y", 4, 7}, {"z", 8, 7}};

/// Fields x y z of float32, and more.
inline std::vector<CloudField> xyz_and(const std::vector<CloudField>& more) {
  std::vector<CloudField> fields = kXyz;
  fields.insert(fields.end(), more.begin(), more.end());
  return fields;
}

inline SerialisedMessage serialised(const std::string& bytes, MessageEncoding encoding) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), encoding, "log: /t"};
}

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
