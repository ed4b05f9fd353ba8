// Numbers of any width in binary files.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
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
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat,
  kDouble
};

inline std::size_t size_of(Scalar type) {
  switch (type) {
    case Scalar::kInt8:
    case Scalar::kUint8:
      return 1;
    case Scalar::kInt16:
    case Scalar::kUint16:
      return 2;
    case Scalar::kInt32:
    case Scalar::kUint32:
    case Scalar::kFloat:
      return 4;
    case Scalar::kInt64:
    case Scalar::kUint64:
    case Scalar::kDouble:
      return 8;
  }
  return 0;
}

/// Appends the bytes of a number, in the byte order of the machine.
template <class Number>
void append_number(Number value, std::string& bytes) {
  char copy[sizeof(value)];
  std::memcpy(copy, &value, sizeof(value));
  bytes.append(copy, sizeof(value));
}

namespace scalar_detail {

template <class T>
double load(const char* bytes, bool swap) {
  char copy[sizeof(T)];
  std::memcpy(copy, bytes, sizeof(T));
  if (swap) std::reverse(copy, copy + sizeof(T));
  T value;
  std::memcpy(&value, copy, sizeof(T));
  return static_cast<double>(value);
}

}  // namespace scalar_detail

/// The number at `bytes`; `swap` reverses its byte order. 64-bit integers are rounded to 53 bits.
inline double load_scalar(Scalar type, const char* bytes, bool swap) {
  using scalar_detail::load;
  switch (type) {
    case Scalar::kInt8:
      return load<std::int8_t>(bytes, swap);
    case Scalar::kUint8:
      return load<std::uint8_t>(bytes, swap);
    case Scalar::kInt16:
      return load<std::int16_t>(bytes, swap);
    case Scalar::kUint16:
      return load<std::uint16_t>(bytes, swap);
    case Scalar::kInt32:
      return load<std::int32_t>(bytes, swap);
    case Scalar::kUint32:
      return load<std::uint32_t>(bytes, swap);
    case Scalar::kInt64:
      return load<std::int64_t>(bytes, swap);
    case Scalar::kUint64:
      return load<std::uint64_t>(bytes, swap);
    case Scalar::kFloat:
      return load<float>(bytes, swap);
    case Scalar::kDouble:
      return load<double>(bytes, swap);
  }
  return 0.0;
}

/// Stores a number at `bytes`. False, with nothing stored, if an integer type cannot hold it.
inline bool store_scalar(Scalar type, double value, char* bytes) {
  const auto store = [&](auto zero) {
    using Number = decltype(zero);
    if constexpr (std::is_integral_v<Number>) {
      // Both limits are exact as doubles.
      const double beyond = std::ldexp(1.0, std::numeric_limits<Number>::digits);
      const double least = std::is_signed_v<Number> ? -beyond : 0.0;
      if (!(value >= least && value < beyond) || value != std::floor(value)) return false;
    }
    const auto number = static_cast<Number>(value);
    std::memcpy(bytes, &number, sizeof(number));
    return true;
  };
  switch (type) {
    case Scalar::kInt8:
      return store(std::int8_t{});
    case Scalar::kUint8:
      return store(std::uint8_t{});
    case Scalar::kInt16:
      return store(std::int16_t{});
    case Scalar::kUint16:
      return store(std::uint16_t{});
    case Scalar::kInt32:
      return store(std::int32_t{});
    case Scalar::kUint32:
      return store(std::uint32_t{});
    case Scalar::kInt64:
      return store(std::int64_t{});
    case Scalar::kUint64:
      return store(std::uint64_t{});
    case Scalar::kFloat:
      return store(to_float(value));
    case Scalar::kDouble:
      return store(value);
  }
  return false;
}

/// As in PCD: I integer, U unsigned, F floating-point.
inline char letter_of(Scalar type) {
  switch (type) {
    case Scalar::kInt8:
    case Scalar::kInt16:
    case Scalar::kInt32:
    case Scalar::kInt64:
      return 'I';
    case Scalar::kFloat:
    case Scalar::kDouble:
      return 'F';
    default:
      return 'U';
  }
}

}  // namespace dynains
