// Layout of LAS files, versions 1.2 to 1.4 (ASPRS), that the reader and the writer share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "../scalar.hpp"

namespace dynains::las {

inline const std::string kMagic = "LASF";
inline constexpr std::size_t kHeaderSize12 = 227;  // bytes, of version 1.2
inline constexpr std::size_t kHeaderSize14 = 375;  // bytes, of version 1.4
inline constexpr std::size_t kVlrHeaderSize = 54;  // bytes, of a variable length record
inline constexpr char kSpecUser[] = "LASF_Spec";
inline constexpr std::uint16_t kExtraBytesRecord = 4;
inline constexpr std::size_t kExtraBytesSize = 192;  // bytes, of the description of one value

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
