// Layout and values of the points of a message with a cloud.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>

#include "../points/point_sink.hpp"
#include "../scalar.hpp"
#include "dynains/io/point_file.hpp"
#include "message_fields.hpp"

namespace dynains {

inline constexpr const char* kPointCloud2 = "sensor_msgs/PointCloud2";

/// Whether the type is CustomMsg of one of the drivers of Livox.
inline bool is_livox(const std::string& type) {
  return type == "livox_ros_driver/CustomMsg" || type == "livox_ros_driver2/CustomMsg" ||
         type == "livox_interfaces/CustomMsg";
}

/// Where the points of a message lie in it, and what their fields mean.
class MessageCloud {
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

  /// Reads a message of a type for which is_cloud_type() holds. It outlives this. Throws IoError
  /// that begins with its place, unless all fields of all points lie within the data.
  MessageCloud(const std::string& type, const SerialisedMessage& message)
      : in_(message), header_(in_.header()) {
    is_livox(type) ? read_livox() : read_point_cloud2();
  }

  const MessageHeader& header() const { return header_; }
  std::size_t size() const { return static_cast<std::size_t>(height_) * width_; }
  std::uint32_t width() const { return width_; }
  /// Bytes of a point, and those behind it up to the next one of a row.
  std::uint32_t point_size() const { return static_cast<std::uint32_t>(point_size_); }
  std::size_t padding() const { return point_step_ - point_size_; }
  /// Point i < size().
  const std::uint8_t* point(std::size_t i) const {
    return data_ + i / width_ * row_step_ + i % width_ * point_step_;
  }
  PointColumns columns() const {
    return columns_of([this](Role role) { return field(role).is_there; });
  }
  /// Number of the sensor, if the message is that of one of several.
  const std::optional<std::uint8_t>& sensor() const { return sensor_; }

  /// Bytes from the begin of the message.
  struct Places {
    std::size_t height = 0;  ///< of PointCloud2; the width and the number of fields follow
    std::size_t fields_end = 0;
    std::size_t data = 0, data_end = 0;  ///< steps and sizes lie before them
  };
  const Places& places() const { return places_; }
  /// Number of all fields of a PointCloud2.
  std::uint32_t field_count() const { return field_count_; }

  /// By its name.
  const Field& field(Role role) const { return fields_[static_cast<std::size_t>(role)]; }

  [[noreturn]] void fail(const std::string& what) const { in_.fail(what); }

 private:
  void read_point_cloud2() {
    height_ = in_.number<std::uint32_t>("a height");
    places_.height = in_.position() - sizeof(height_);
    width_ = in_.number<std::uint32_t>("a width");
    read_fields();
    places_.fields_end = in_.position();
    const bool is_big_endian = in_.number<std::uint8_t>("is_bigendian") != 0;
    for (Field& field : fields_) field.is_big_endian = is_big_endian;
    point_step_ = point_size_ = in_.number<std::uint32_t>("a point step");
    row_step_ = in_.number<std::uint32_t>("a row step");
    const std::uint32_t bytes = in_.length(1, "data");
    take_data(bytes);
    if (size() == 0) return;
    check_fields();
    check_size(bytes);
  }
  /// Points have fixed fields. CDR aligns the first one of each, an offset time.
  void read_livox() {
    in_.number<std::uint64_t>("a time base");
    in_.number<std::uint32_t>("a number of points");
    sensor_ = in_.number<std::uint8_t>("a lidar id");
    in_.skip(3, "reserved bytes");
    point_size_ = 19;
    point_step_ = in_.is_ros1() ? point_size_ : 20;
    width_ = in_.length(point_size_, "points");
    set(Role::kTime, 0, Scalar::kUint32);
    for (std::uint32_t k = 0; k < 3; ++k) set(kUsualRoles[k], 4 + 4 * k, Scalar::kFloat);
    set(Role::kIntensity, 16, Scalar::kUint8);
    set(Role::kRing, 18, Scalar::kUint8);
    take_data(width_ == 0 ? 0 : width_ * point_step_ - padding());
  }
  void take_data(std::uint64_t bytes) {
    places_.data = in_.position();
    data_ = in_.take(bytes, "data");
    places_.data_end = in_.position();
  }
  void set(Role role, std::uint32_t offset, Scalar type) {
    fields_[static_cast<std::size_t>(role)] = {true, offset, type, false};
  }
  void read_fields() {
    // Each has 13 bytes or more: length of the name, offset, datatype, count.
    field_count_ = in_.length(13, "fields");
    for (std::uint32_t i = 0; i < field_count_; ++i) {
      const std::string name = in_.string("a field name");
      const auto offset = in_.number<std::uint32_t>("a field offset");
      const auto datatype = in_.number<std::uint8_t>("a field datatype");
      in_.number<std::uint32_t>("a field count");
      const Role role = role_of(name);
      if (role == Role::kNone || field(role).is_there) continue;
      if (datatype < 1 || datatype > std::size(kFieldTypes)) {
        in_.fail("expected a datatype from 1 to 8 of field " + name + ", found " +
                 std::to_string(datatype));
      }
      set(role, offset, kFieldTypes[datatype - 1]);
    }
  }
  void check_fields() const {
    for (const Role axis : {Role::kX, Role::kY, Role::kZ}) {
      if (!field(axis).is_there || field(axis).is_integer()) {
        in_.fail("expected the fields x, y and z as float32 or float64");
      }
    }
    for (const Field& one : fields_) {
      if (one.is_there && one.offset + size_of(one.type) > point_step_) {
        in_.fail("expected all fields within the " + std::to_string(point_step_) +
                 " bytes of a point");
      }
    }
  }
  /// Rows may be padded; some drivers leave the row step 0, or that of the cloud before a filter.
  void check_size(std::uint64_t bytes) {
    const std::uint64_t packed = width_ * point_step_;
    if (height_ == 1 || row_step_ < packed || packed * height_ == bytes) row_step_ = packed;
    if (packed <= bytes && (bytes - packed) / row_step_ >= height_ - 1) return;
    in_.fail("expected " + std::to_string(height_) + " rows of " + std::to_string(row_step_) +
             " bytes, found " + std::to_string(bytes) + " bytes");
  }

  MessageReader in_;
  MessageHeader header_;
  std::array<Field, static_cast<std::size_t>(Role::kNone)> fields_;
  std::uint32_t height_ = 1;
  std::uint32_t width_ = 0;
  std::uint64_t point_size_ = 0, point_step_ = 0, row_step_ = 0;  // bytes
  std::optional<std::uint8_t> sensor_;
  const std::uint8_t* data_ = nullptr;
  std::uint32_t field_count_ = 0;
  Places places_;
};

}  // namespace dynains
