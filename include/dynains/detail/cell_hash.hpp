// Hash of the place of a grid cell, for direct-mapped tables.
#pragma once

#include <cstddef>
#include <cstdint>

namespace dynains::detail {

/// 24 well-mixed bits of any number of 32-bit coordinates.
template <class... Coordinates>
std::size_t cell_hash(Coordinates... coordinates) {
  constexpr std::uint64_t kMix = 0x9E3779B97F4A7C15ULL;  // 2^64 over the golden ratio
  std::uint64_t hash = 0;
  ((hash = hash * kMix + static_cast<std::uint32_t>(coordinates)), ...);
  return static_cast<std::size_t>((hash * kMix) >> 40);
}

}  // namespace dynains::detail
