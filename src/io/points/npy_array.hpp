// Arrays of NumPy in files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "../logs/bytes.hpp"
#include "../scalar.hpp"

namespace dynains {

/// Header of an array (.npy, format 1 to 3).
struct NpyArray {
  /// A field of a structured array, or the only value of another one.
  struct Field {
    std::string name;            ///< empty if the array is not structured
    std::optional<Scalar> type;  ///< empty: not a number that is read here
    bool swap = false;           ///< big-endian
    std::size_t offset = 0;      ///< bytes from the begin of an item
  };

  std::vector<Field> fields;
  std::vector<std::uint64_t> shape;
  bool is_column_major = false;
  std::size_t item_size = 0;     ///< bytes
  std::uint64_t data_begin = 0;  ///< byte of the first item

  bool is_structured() const { return !fields.front().name.empty(); }
  /// Product of the shape.
  std::uint64_t item_count() const;
};

/// Longest header that is read.
inline constexpr std::size_t kMaxNpyHeader = std::size_t{1} << 16U;

/// Reads the header at the begin of `in`, which holds the first bytes of an array of `size` bytes,
/// at least kMaxNpyHeader of them if there are as many. Throws IoError unless all items lie
/// within `size`.
NpyArray parse_npy_header(Bytes in, std::uint64_t size);

}  // namespace dynains
