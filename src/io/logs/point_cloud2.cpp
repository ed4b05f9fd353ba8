#include "point_cloud2.hpp"

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
  places_.height = in.position() - sizeof(height_);
  width_ = in.number<std::uint32_t>("a width");
  read_fields(in);
  places_.fields_end = in.position();
  const bool is_big_endian = in.number<std::uint8_t>("is_bigendian") != 0;
  for (Field& field : fields_) field.is_big_endian = is_big_endian;
  point_step_ = in.number<std::uint32_t>("a point step");
  row_step_ = in.number<std::uint32_t>("a row step");
  const std::uint32_t bytes = in.length(1, "data");
  places_.data = in.position();
  places_.data_end = places_.data + bytes;
  data_ = in.take(bytes, "data");
  if (size() == 0) return;
  check_fields(in);
  check_size(in, bytes);
}

PointColumns PointCloud2::columns() const {
  PointColumns columns;
  columns.intensity = field(Role::kIntensity).is_there;
  columns.ring = field(Role::kRing).is_there;
  columns.time = field(Role::kTime).is_there;
  columns.label = field(Role::kLabel).is_there;
  return columns;
}

void PointCloud2::read_fields(MessageReader& in) {
  // Each has 13 bytes or more: length of the name, offset, datatype, count.
  field_names_.resize(in.length(13, "fields"));
  for (std::string& name : field_names_) {
    name = in.string("a field name");
    const auto offset = in.number<std::uint32_t>("a field offset");
    const auto datatype = in.number<std::uint8_t>("a field datatype");
    in.number<std::uint32_t>("a field count");
    const Role role = role_of(name);
    if (role == Role::kNone || field(role).is_there) continue;
    const std::optional<Scalar> type = scalar_of(datatype);
    if (!type) {
      in.fail("expected a datatype from 1 to 8 of field " + name + ", found " +
              std::to_string(datatype));
    }
    fields_[static_cast<std::size_t>(role)] = {true, offset, *type, false};
  }
}

void PointCloud2::check_fields(const MessageReader& in) const {
  for (const Role axis : {Role::kX, Role::kY, Role::kZ}) {
    if (!field(axis).is_there || field(axis).is_integer()) {
      in.fail("expected the fields x, y and z as float32 or float64");
    }
  }
  for (const Field& one : fields_) {
    if (one.is_there && one.offset + size_of(one.type) > point_step_) {
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
