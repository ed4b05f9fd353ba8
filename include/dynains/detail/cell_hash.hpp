// Hash of the place of a grid cell, for direct-mapped tables.
#pragma once

#include <cstddef>
#include <cstdint>

namespace dynains::detail {

/// 24 well-mixed bits of a packed place.
inline std::size_t place_hash(std::uint64_t place) {
  constexpr std::uint64_t kMix = 0x9E3779B97F4A7C15ULL;  // 2^64 over the golden ratio
  return static_cast<std::size_t>(((place ^ place >> 32U) * kMix) >> 40U);
}

}  // namespace dynains::detail
