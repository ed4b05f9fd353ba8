// Hash of the place of a grid cell, for direct-mapped tables.
#pragma once

#include <cstddef>
#include <cstdint>

namespace dynains::detail {

/// 24 well-mixed bits of a packed place and a number.
inline std::size_t place_hash(std::uint64_t place, std::uint32_t number = 0) {
  constexpr std::uint64_t kMix = 0x9E3779B97F4A7C15ULL;  // 2^64 over the golden ratio
  const std::uint64_t both = place ^ number * std::uint64_t{0xD6E8FEB86659FD93ULL};
  return static_cast<std::size_t>(((both ^ both >> 32U) * kMix) >> 40U);
}

}  // namespace dynains::detail
