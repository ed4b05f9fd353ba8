// Layout and values of the points of a sensor_msgs/PointCloud2.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "../points/point_sink.hpp"
#include "../scalar.hpp"
#include "dynains/io/point_file.hpp"
#include "message_reader.hpp"

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
      return load_scalar(type, reinterpret_cast<const char*>(point) + offset, is_big_endian);
    }
    bool is_integer() const { return type != Scalar::kFloat && type != Scalar::kDouble; }
  };

  /// Reads what follows the header of the message, without padding at its end. `in` and the message
  /// outlive this. Throws IoError unless all fields of all points lie within the data.
  explicit PointCloud2(MessageReader& in);

  std::size_t size() const { return static_cast<std::size_t>(height_) * width_; }
  std::uint32_t width() const { return width_; }
  std::uint32_t point_step() const { return static_cast<std::uint32_t>(point_step_); }
  /// Point i < size().
  const std::uint8_t* point(std::size_t i) const {
    return data_ + i / width_ * row_step_ + i % width_ * point_step_;
  }
  PointColumns columns() const;

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
  void read_fields(MessageReader& in);
  void check_fields(const MessageReader& in) const;
  void check_size(const MessageReader& in, std::uint64_t bytes);

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
