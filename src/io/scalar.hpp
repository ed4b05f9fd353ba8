// Numbers of any width in binary files.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>

namespace dynains {

/// Conversion of a double beyond the range of float is undefined: it becomes infinite.
inline float to_float(double value) {
  constexpr double kMax = std::numeric_limits<float>::max();
  if (value > kMax) return std::numeric_limits<float>::infinity();
  if (value < -kMax) return -std::numeric_limits<float>::infinity();
  return static_cast<float>(value);
}

enum class Scalar : std::uint8_t {
  kFloat,
  kDouble,
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64
};
/// In the order of Scalar.
using Scalars = std::tuple<float, double, std::int8_t, std::uint8_t, std::int16_t, std::uint16_t,
                           std::int32_t, std::uint32_t, std::int64_t, std::uint64_t>;

/// Calls `use(zero)` with a zero of the type.
template <std::size_t kNumber = 0, class Use>
auto with_type(Scalar type, Use&& use) {
  if constexpr (kNumber + 1 < std::tuple_size_v<Scalars>) {
    if (static_cast<std::size_t>(type) != kNumber) return with_type<kNumber + 1>(type, use);
  }
  return use(std::tuple_element_t<kNumber, Scalars>());
}

inline std::size_t size_of(Scalar type) {
  return with_type(type, [](auto zero) { return sizeof(zero); });
}

/// The type of that kind, 'i' for signed, 'u' for unsigned and 'f' for floating-point numbers, and
/// size in bytes; nothing if there is none.
inline std::optional<Scalar> scalar_of(char kind, std::size_t size) {
  for (std::size_t i = 0; i < std::tuple_size_v<Scalars>; ++i) {
    const auto type = static_cast<Scalar>(i);
    const char its_kind = with_type(type, [](auto zero) {
      using Number = decltype(zero);
      if (std::is_floating_point_v<Number>) return 'f';
      if (std::is_signed_v<Number>) return 'i';
      return 'u';
    });
    if (its_kind == kind && size_of(type) == size) return type;
  }
  return std::nullopt;
}

/// Appends the bytes of a number, in the byte order of the machine.
template <class Number>
void append_number(Number value, std::string& bytes) {
  char copy[sizeof(value)];
  std::memcpy(copy, &value, sizeof(value));
  bytes.append(copy, sizeof(value));
}

/// The number at `bytes`; `swap` reverses its byte order. 64-bit integers are rounded to 53 bits.
inline double load_scalar(Scalar type, const void* bytes, bool swap) {
  return with_type(type, [&](auto number) {
    char copy[sizeof(number)];
    std::memcpy(copy, bytes, sizeof(number));
    if (swap) std::reverse(copy, copy + sizeof(number));
    std::memcpy(&number, copy, sizeof(number));
    return static_cast<double>(number);
  });
}

/// Converts a number. False, with `target` as it was, if an integer type cannot hold it.
template <class Number>
bool store_number(double value, Number& target) {
  if constexpr (std::is_integral_v<Number>) {
    // Both limits are exact as doubles. The comparison is false for NaN.
    const double beyond = std::ldexp(1.0, std::numeric_limits<Number>::digits);
    const double least = std::is_signed_v<Number> ? -beyond : 0.0;
    if (!(value >= least && value < beyond) || value != std::floor(value)) return false;
  }
  if constexpr (std::is_same_v<Number, float>) {
    target = to_float(value);
  } else {
    target = static_cast<Number>(value);
  }
  return true;
}

/// Numbers and texts in a row, little endian.
class ByteWriter {
 public:
  template <class Number>
  ByteWriter& number(Number value) {
    append_number(value, bytes_);
    return *this;
  }
  template <class... Numbers>
  ByteWriter& numbers(Numbers... values) {
    (number(values), ...);
    return *this;
  }
  ByteWriter& raw(const std::string& bytes) {
    bytes_ += bytes;
    return *this;
  }
  ByteWriter& zeros(std::size_t count) { return raw(std::string(count, '\0')); }
  /// A text behind its length, uint32.
  ByteWriter& string(const std::string& text) {
    return number(static_cast<std::uint32_t>(text.size())).raw(text);
  }
  /// A text of at most `size` bytes, filled up with zeros.
  ByteWriter& text(std::string_view text, std::size_t size) {
    return raw(std::string(text.substr(0, size))).zeros(size - std::min(size, text.size()));
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

}  // namespace dynains
