// Support for PointCloud2 messages: sensor_msgs of ROS 1 and ROS 2, pcl::PCLPointCloud2, and types
// with equal members. The message type is a template parameter, so ROS is not required.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>

#include "dynains/errors.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// Non-owning view of the points of a message, which must outlive the view.
///
///     remover.push(PointCloud2View(*message), T_world_sensor, message_time(*message));
///
/// The coordinates are the fields "x", "y" and "z", each FLOAT32 or FLOAT64 at any offset. Either
/// byte order, other fields and padding of rows are supported. Points are numbered row by row, and
/// labels have this order.
class PointCloud2View {
 public:
  /// Throws CloudError if a coordinate is missing or has another type, or if the layout does not
  /// match the data. The message names the field and its value.
  template <class Message>
  explicit PointCloud2View(const Message& message)
      : data_(reinterpret_cast<const unsigned char*>(message.data.data())),
        width_(message.width),
        height_(message.height),
        point_step_(message.point_step),
        row_step_(height_ == 1 ? width_ * point_step_ : std::size_t{message.row_step}),
        is_packed_(row_step_ == width_ * point_step_),
        is_swapped_((message.is_bigendian != 0) != is_host_big_endian()) {
    if (size() > std::numeric_limits<std::uint32_t>::max()) {
      throw CloudError("PointCloud2: width * height = " + std::to_string(size()) +
                       " must fit 32 bits");
    }
    if (size() == 0) return;
    x_ = find(message, "x");
    y_ = find(message, "y");
    z_ = find(message, "z");
    is_plain_ = !is_swapped_ && x_.size == 4 && y_.size == 4 && z_.size == 4;
    const std::size_t row = width_ * point_step_;
    if (row_step_ < row) {
      throw CloudError("PointCloud2: row_step = " + std::to_string(row_step_) +
                       " must be at least width * point_step = " + std::to_string(row));
    }
    // The last row may lack its padding. The factors have 32 bits, so the product cannot overflow.
    const std::size_t needed = (height_ - 1) * row_step_;
    if (message.data.size() < needed || message.data.size() - needed < row) {
      throw CloudError("PointCloud2: data has " + std::to_string(message.data.size()) + " bytes, " +
                       std::to_string(width_) + " x " + std::to_string(height_) + " points of " +
                       std::to_string(point_step_) + " bytes need more");
    }
  }

  std::size_t size() const { return width_ * height_; }

  /// Coordinates of point i < size(), m, frame of the message. push() requires the sensor frame.
  Eigen::Vector3f point(std::size_t i) const {
    const unsigned char* const p = at(i);
    if (is_plain_)
      return {read<float>(p + x_.offset), read<float>(p + y_.offset), read<float>(p + z_.offset)};
    return {coordinate(p, x_), coordinate(p, y_), coordinate(p, z_)};
  }

  /// First byte of the `point_step` bytes of point i < size().
  const unsigned char* at(std::size_t i) const {
    if (is_packed_) return data_ + i * point_step_;
    return data_ + (i / width_) * row_step_ + (i % width_) * point_step_;
  }

 private:
  struct Field {
    std::size_t offset = 0;  // bytes from the start of the point
    std::size_t size = 0;    // bytes: 4 or 8
  };

  static bool is_host_big_endian() {
    constexpr std::uint16_t kOne = 1;
    unsigned char first = 0;
    std::memcpy(&first, &kOne, 1);
    return first == 0;
  }

  template <class Message>
  Field find(const Message& message, const char* name) const {
    constexpr int kFloat32 = 7;  // as in sensor_msgs/PointField
    constexpr int kFloat64 = 8;
    std::string names;
    for (const auto& field : message.fields) {
      if (field.name != name) {
        names += (names.empty() ? "" : ", ") + std::string(field.name);
        continue;
      }
      const int type = static_cast<int>(field.datatype);
      if (type != kFloat32 && type != kFloat64) {
        throw CloudError("PointCloud2: field '" + std::string(name) + "' has datatype " +
                         std::to_string(type) + ", expected 7 (FLOAT32) or 8 (FLOAT64)");
      }
      const Field found{field.offset, type == kFloat32 ? sizeof(float) : sizeof(double)};
      if (found.offset + found.size > point_step_) {
        throw CloudError("PointCloud2: field '" + std::string(name) + "' ends at byte " +
                         std::to_string(found.offset + found.size) + " of a point of " +
                         std::to_string(point_step_) + " bytes");
      }
      return found;
    }
    throw CloudError("PointCloud2: no field '" + std::string(name) + "', only: " + names);
  }

  template <class Scalar>
  static Scalar read(const unsigned char* bytes) {
    Scalar value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
  }

  float coordinate(const unsigned char* point, Field field) const {
    unsigned char bytes[8] = {};
    for (std::size_t i = 0; i < field.size; ++i) {
      bytes[i] = point[field.offset + (is_swapped_ ? field.size - 1 - i : i)];
    }
    return field.size == 4 ? read<float>(bytes) : static_cast<float>(read<double>(bytes));
  }

  const unsigned char* data_;
  std::size_t width_, height_, point_step_, row_step_;
  bool is_packed_, is_swapped_;
  bool is_plain_ = false;  // three floats in host byte order, the usual case
  Field x_, y_, z_;
};

template <>
struct PointCloudTraits<PointCloud2View> {
  static std::size_t size(const PointCloud2View& cloud) { return cloud.size(); }
  static Eigen::Vector3f point(const PointCloud2View& cloud, std::size_t i) {
    return cloud.point(i);
  }
};

namespace detail {

template <class Stamp>
auto nanoseconds(const Stamp& stamp, int) -> decltype(stamp.nanosec) {  // ROS 2
  return stamp.nanosec;
}
template <class Stamp>
auto nanoseconds(const Stamp& stamp, long) -> decltype(stamp.nsec) {  // ROS 1
  return stamp.nsec;
}

}  // namespace detail

/// Time stamp of a ROS 1 or ROS 2 message, s.
template <class Message>
double message_time(const Message& message) {
  const auto& stamp = message.header.stamp;
  return static_cast<double>(stamp.sec) + 1e-9 * static_cast<double>(detail::nanoseconds(stamp, 0));
}

/// Copy of the points of `message` for whose label `is_kept(label)` holds, with all fields and the
/// header, as one row. `labels`: by point of `message`. Throws CloudError for an invalid layout,
/// and std::invalid_argument if the sizes differ.
template <class Message, class IsKept>
Message select_points(const Message& message, Span<const PointLabel> labels, IsKept&& is_kept) {
  const PointCloud2View view(message);
  if (labels.size() != view.size()) {
    throw std::invalid_argument("select_points: as many labels as points are needed");
  }
  Message result;
  result.header = message.header;
  result.fields = message.fields;
  result.is_bigendian = message.is_bigendian;
  result.is_dense = message.is_dense;
  result.point_step = message.point_step;
  std::size_t count = 0;
  for (const PointLabel label : labels) count += is_kept(label) ? 1 : 0;
  result.height = 1;
  result.width = static_cast<std::uint32_t>(count);
  result.row_step = static_cast<std::uint32_t>(count * message.point_step);
  result.data.resize(count * message.point_step);
  auto to = result.data.begin();
  for (std::size_t i = 0; i < view.size(); ++i) {
    if (!is_kept(labels[i])) continue;
    std::memcpy(&*to, view.at(i), message.point_step);
    to += static_cast<std::ptrdiff_t>(message.point_step);
  }
  return result;
}

/// The points with a static label; see select_points().
template <class Message>
Message static_points(const Message& message, Span<const PointLabel> labels) {
  return select_points(message, labels, is_static);
}

/// The points of moving instances; see select_points().
template <class Message>
Message dynamic_points(const Message& message, Span<const PointLabel> labels) {
  return select_points(message, labels,
                       [](PointLabel label) { return label == PointLabel::kDynamic; });
}

}  // namespace dynains
