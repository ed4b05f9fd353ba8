// Layout and values of the points of a sensor_msgs/PointCloud2.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <vector>

#include "../points/point_sink.hpp"
#include "../scalar.hpp"
#include "dynains/io/point_file.hpp"
#include "message_fields.hpp"

namespace dynains {

/// Where the points of a message lie in it.
class PointCloud2 {
 public:
  /// A field of a point; absent unless the message has it.
  struct Field {
    bool is_there = false;
    std::uint32_t offset = 0;  ///< bytes from the begin of a point
    Scalar type = Scalar::kFloat;
    bool is_big_endian = false;

    double value(const std::uint8_t* point) const {
      return load_scalar(type, point + offset, is_big_endian);
    }
    bool is_integer() const { return type != Scalar::kFloat && type != Scalar::kDouble; }
  };

  /// Reads what follows the header of the message, without padding at its end. `in` and the message
  /// outlive this. Throws IoError unless all fields of all points lie within the data.
  explicit PointCloud2(MessageReader& in) {
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

  std::size_t size() const { return static_cast<std::size_t>(height_) * width_; }
  std::uint32_t width() const { return width_; }
  std::uint32_t point_step() const { return static_cast<std::uint32_t>(point_step_); }
  /// Point i < size().
  const std::uint8_t* point(std::size_t i) const {
    return data_ + i / width_ * row_step_ + i % width_ * point_step_;
  }
  PointColumns columns() const {
    return columns_of([this](Role role) { return field(role).is_there; });
  }

  /// Bytes from the begin of the message.
  struct Places {
    std::size_t height = 0;  ///< the width and the number of fields follow
    std::size_t fields_end = 0;
    std::size_t data = 0, data_end = 0;  ///< steps and the size of the data lie before them
  };
  const Places& places() const { return places_; }
  /// The names of all fields, in the order of the message.
  const std::vector<std::string>& field_names() const { return field_names_; }

  /// By its name.
  const Field& field(Role role) const { return fields_[static_cast<std::size_t>(role)]; }

 private:
  void read_fields(MessageReader& in) {
    // Each has 13 bytes or more: length of the name, offset, datatype, count.
    field_names_.resize(in.length(13, "fields"));
    for (std::string& name : field_names_) {
      name = in.string("a field name");
      const auto offset = in.number<std::uint32_t>("a field offset");
      const auto datatype = in.number<std::uint8_t>("a field datatype");
      in.number<std::uint32_t>("a field count");
      const Role role = role_of(name);
      if (role == Role::kNone || field(role).is_there) continue;
      if (datatype < 1 || datatype > std::size(kFieldTypes)) {
        in.fail("expected a datatype from 1 to 8 of field " + name + ", found " +
                std::to_string(datatype));
      }
      fields_[static_cast<std::size_t>(role)] = {true, offset, kFieldTypes[datatype - 1], false};
    }
  }
  void check_fields(const MessageReader& in) const {
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
  void check_size(const MessageReader& in, std::uint64_t bytes) {
    const std::uint64_t packed = width_ * point_step_;
    if (height_ == 1 || row_step_ < packed || packed * height_ == bytes) row_step_ = packed;
    if (packed <= bytes && (bytes - packed) / row_step_ >= height_ - 1) return;
    in.fail("expected " + std::to_string(height_) + " rows of " + std::to_string(row_step_) +
            " bytes, found " + std::to_string(bytes) + " bytes");
  }

  std::array<Field, static_cast<std::size_t>(Role::kNone)> fields_;
  std::uint32_t height_ = 0;
  std::uint32_t width_ = 0;
  std::uint64_t point_step_ = 0;  // bytes
  std::uint64_t row_step_ = 0;    // bytes
  const std::uint8_t* data_ = nullptr;
  std::vector<std::string> field_names_;
  Places places_;
};

}  // namespace dynains
