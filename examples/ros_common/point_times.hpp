// Times of the points of a PointCloud2 message, for any type of message.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "dynains/adapters/point_cloud2.hpp"

namespace dynains_ros {

namespace detail {

/// Value of a number of sensor_msgs/PointField, in the byte order of this machine.
inline double number_at(const unsigned char* bytes, int datatype) {
  const auto read = [bytes](auto value) {
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<double>(value);
  };
  switch (datatype) {
    case 5:
      return read(std::int32_t{});
    case 6:
      return read(std::uint32_t{});
    case 7:
      return read(float{});
    default:
      return read(double{});
  }
}

}  // namespace detail

/// For each point the seconds from `stamp` (s) until it was measured, by the field time, t,
/// timestamp, time_stamp or offset_time; empty if there is none, or if no unit from s to ns makes a
/// scan of 5 to 500 ms of it.
template <class Message>
std::vector<double> point_offsets(const Message& message, double stamp) {
  constexpr double kShortest = 0.005, kLongest = 0.5, kAbsolute = 10.0;  // s
  const auto is_time = [](const auto& field) {
    const std::string name = field.name;
    const int type = static_cast<int>(field.datatype);
    return type >= 5 && type <= 8 &&
           (name == "time" || name == "t" || name == "timestamp" || name == "time_stamp" ||
            name == "offset_time");
  };
  const auto field = std::find_if(message.fields.begin(), message.fields.end(), is_time);
  const dynains::PointCloud2View view(message);
  if (field == message.fields.end() || message.is_bigendian || view.size() == 0) return {};
  const std::size_t end = std::size_t{field->offset} + (field->datatype == 8 ? 8 : 4);
  if (end > message.point_step) return {};
  std::vector<double> times;
  double first = INFINITY, last = -INFINITY;
  for (std::size_t i = 0; i < view.size(); ++i) {
    times.push_back(detail::number_at(view.at(i) + field->offset, field->datatype));
    if (!std::isfinite(times.back()) || view.point(i).isZero(0.0F)) continue;
    first = std::min(first, times.back());
    last = std::max(last, times.back());
  }
  for (const double unit : {1.0, 1e-3, 1e-6, 1e-9}) {
    const double span = unit * (last - first);
    if (!(span >= kShortest && span <= kLongest)) continue;
    const double origin = unit * std::abs(first) > kAbsolute ? stamp : 0.0;
    for (double& time : times) time = unit * time - origin;
    return times;
  }
  return {};
}

}  // namespace dynains_ros
