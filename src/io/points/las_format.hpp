// Layout of LAS files, versions 1.2 to 1.4 (ASPRS), that the reader and the writer share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "../scalar.hpp"

namespace dynains::las {

/// Signature of a file, and user and number of its record of extra bytes.
struct Marks {
  std::string_view magic = "LASF", spec_user = "LASF_Spec";
  std::uint16_t extra_bytes_record = 4;
};
inline constexpr Marks kMarks;

/// Bytes of the parts of a file.
struct Sizes {
  std::size_t header_1_2 = 227, header_1_4 = 375;
  std::size_t before_count = 247;  ///< the number of points in 64 bits, in the header of 1.4
  std::size_t record_header = 54;  ///< of a variable length record
  std::size_t extra_bytes = 192;   ///< of the description of one value
};
inline constexpr Sizes kSizes;

/// Parts of a point record, by its format.
struct PointFormat {
  std::uint16_t size;        ///< bytes, without extra bytes
  std::uint16_t gps_offset;  ///< bytes from the begin; 0: no time
};
inline constexpr PointFormat kPointFormats[] = {{20, 0},  {28, 20}, {26, 0},  {34, 20},
                                                {57, 20}, {63, 20}, {30, 22}, {36, 22},
                                                {38, 22}, {59, 22}, {67, 22}};

/// Types of extra bytes; index 0 has no type.
inline constexpr Scalar kExtraTypes[] = {Scalar::kUint8,  Scalar::kUint8,  Scalar::kInt8,
                                         Scalar::kUint16, Scalar::kInt16,  Scalar::kUint32,
                                         Scalar::kInt32,  Scalar::kUint64, Scalar::kInt64,
                                         Scalar::kFloat,  Scalar::kDouble};

}  // namespace dynains::las
