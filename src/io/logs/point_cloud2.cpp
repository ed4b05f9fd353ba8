#include "point_cloud2.hpp"

#include <algorithm>
#include <iterator>
#include <optional>

#include "message_writer.hpp"

namespace dynains {
namespace {

/// By the datatype of sensor_msgs/PointField.
std::optional<Scalar> scalar_of(std::uint8_t datatype) {
  if (datatype < 1 || datatype > std::size(kFieldTypes)) return std::nullopt;
  return kFieldTypes[datatype - 1];
}

}  // namespace

PointCloud2::PointCloud2(MessageReader& in) {
  height_ = in.number<std::uint32_t>("a height");
  width_ = in.number<std::uint32_t>("a width");
  read_fields(in);
  const bool is_big_endian = in.number<std::uint8_t>("is_bigendian") != 0;
  for (Field* const field : {&x, &y, &z, &intensity, &ring, &time, &label}) {
    field->is_big_endian = is_big_endian;
  }
  point_step_ = in.number<std::uint32_t>("a point step");
  row_step_ = in.number<std::uint32_t>("a row step");
  const std::uint32_t bytes = in.length(1, "data");
  data_ = in.take(bytes, "data");
  if (size() == 0) return;
  check_fields(in);
  check_size(in, bytes);
}

PointColumns PointCloud2::columns() const {
  PointColumns columns;
  columns.intensity = intensity.is_there;
  columns.ring = ring.is_there;
  columns.time = time.is_there;
  columns.label = label.is_there;
  return columns;
}

PointCloud2::Field* PointCloud2::field_of(const std::string& name) {
  struct Alias {
    const char* name;
    Field PointCloud2::*field;
  };
  static constexpr Alias kAliases[] = {
      {"x", &PointCloud2::x},
      {"y", &PointCloud2::y},
      {"z", &PointCloud2::z},
      {"intensity", &PointCloud2::intensity},
      {"i", &PointCloud2::intensity},
      {"reflectivity", &PointCloud2::intensity},
      {"ring", &PointCloud2::ring},
      {"channel", &PointCloud2::ring},
      {"line", &PointCloud2::ring},
      {"time", &PointCloud2::time},
      {"t", &PointCloud2::time},
      {"timestamp", &PointCloud2::time},
      {"time_stamp", &PointCloud2::time},
      {"offset_time", &PointCloud2::time},
      {"label", &PointCloud2::label},
      {"class", &PointCloud2::label},
  };
  const auto alias = std::find_if(std::begin(kAliases), std::end(kAliases),
                                  [&](const Alias& one) { return name == one.name; });
  return alias == std::end(kAliases) ? nullptr : &(this->*alias->field);
}

void PointCloud2::read_fields(MessageReader& in) {
  constexpr std::size_t kLeastField = 13;  // bytes: length of the name, offset, datatype, count
  const std::uint32_t count = in.length(kLeastField, "fields");
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::string name = in.string("a field name");
    const auto offset = in.number<std::uint32_t>("a field offset");
    const auto datatype = in.number<std::uint8_t>("a field datatype");
    in.number<std::uint32_t>("a field count");
    Field* const field = field_of(name);
    if (field == nullptr || field->is_there) continue;
    const std::optional<Scalar> type = scalar_of(datatype);
    if (!type) {
      in.fail("expected a datatype from 1 to 8 of field " + name + ", found " +
              std::to_string(datatype));
    }
    *field = {true, offset, *type, false};
  }
}

void PointCloud2::check_fields(const MessageReader& in) const {
  for (const Field* const field : {&x, &y, &z}) {
    if (!field->is_there || field->is_integer()) {
      in.fail("expected the fields x, y and z as float32 or float64");
    }
  }
  for (const Field* const field : {&x, &y, &z, &intensity, &ring, &time, &label}) {
    if (field->is_there && field->offset + size_of(field->type) > point_step_) {
      in.fail("expected all fields within the " + std::to_string(point_step_) +
              " bytes of a point");
    }
  }
}

/// Rows may be padded; some drivers leave the row step 0, or that of the cloud before a filter.
void PointCloud2::check_size(const MessageReader& in, std::uint64_t bytes) {
  const std::uint64_t packed = width_ * point_step_;
  if (height_ == 1 || row_step_ < packed || packed * height_ == bytes) row_step_ = packed;
  if (packed <= bytes && (bytes - packed) / row_step_ >= height_ - 1) return;
  in.fail("expected " + std::to_string(height_) + " rows of " + std::to_string(row_step_) +
          " bytes, found " + std::to_string(bytes) + " bytes");
}

}  // namespace dynains
