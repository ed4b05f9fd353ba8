// A PointCloud2 replacement, and messages with point coordinates that are worked out by hand.
#pragma once

#include "support/standard.hpp"

namespace dynains::test {

struct LookAlikeField {
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = 0;
  std::uint32_t count = 1;
};

struct LookAlike {
  struct {
    struct {
      std::int32_t sec = 0;
      std::uint32_t nanosec = 0;
    } stamp;
    std::string frame_id;
  } header;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::vector<LookAlikeField> fields;
  bool is_bigendian = false;
  std::uint32_t point_step = 0;
  std::uint32_t row_step = 0;
  std::vector<std::uint8_t> data;
  bool is_dense = false;
};

inline constexpr std::uint8_t kUint16 = 4;
inline constexpr std::uint8_t kFloat32 = 7;
inline constexpr std::uint8_t kFloat64 = 8;

/// Layout of the data of a message.
struct Layout {
  std::uint32_t x = 0, y = 4, z = 8;  // offsets
  std::uint8_t type = kFloat32;
  std::uint32_t point_step = 16;
  std::uint32_t height = 1;
  std::uint32_t padding = 0;  // bytes after each row
  bool swapped = false;       // uses the byte order that this machine does not have
};

inline bool host_is_big_endian() {
  const std::uint16_t one = 1;
  unsigned char first = 0;
  std::memcpy(&first, &one, 1);
  return first == 0;
}

template <class Message>
void add_field(Message& message, const char* name, std::uint32_t offset, std::uint8_t type) {
  message.fields.emplace_back();
  message.fields.back().name = name;
  message.fields.back().offset = offset;
  message.fields.back().datatype = type;
  message.fields.back().count = 1;
}

template <class Message>
Message make_message(const std::vector<Eigen::Vector3f>& points, const Layout& layout = {}) {
  Message message;
  message.height = layout.height;
  message.width = static_cast<std::uint32_t>(points.size()) / layout.height;
  message.point_step = layout.point_step;
  message.row_step = message.width * layout.point_step + layout.padding;
  message.is_bigendian = host_is_big_endian() != layout.swapped;
  // Fields in another order than their offsets, with an unknown field among them.
  add_field(message, "z", layout.z, layout.type);
  add_field(message, "ring", 0, kUint16);
  add_field(message, "x", layout.x, layout.type);
  add_field(message, "y", layout.y, layout.type);
  message.data.assign(std::size_t{message.row_step} * message.height, 0xEE);
  const auto put = [&](std::size_t at, float value) {
    unsigned char bytes[8];
    const std::size_t size = layout.type == kFloat32 ? 4 : 8;
    const double wide = value;
    std::memcpy(bytes, size == 4 ? static_cast<const void*>(&value) : &wide, size);
    if (layout.swapped) std::reverse(bytes, bytes + size);
    std::copy(bytes, bytes + size, message.data.begin() + static_cast<std::ptrdiff_t>(at));
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t at = (i / message.width) * message.row_step +
                           (i % message.width) * std::size_t{layout.point_step};
    put(at + layout.x, points[i].x());
    put(at + layout.y, points[i].y());
    put(at + layout.z, points[i].z());
  }
  return message;
}

}  // namespace dynains::test
