// Hashes of places in a grid.
#pragma once

#include <cstddef>
#include <cstdint>

namespace dynains::detail {

/// 24 well-mixed bits of a packed place.
inline std::size_t place_hash(std::uint64_t place) {
  constexpr std::uint64_t kMix = 0x9E3779B97F4A7C15ULL;  // 2^64 over the golden ratio
  return static_cast<std::size_t>(((place ^ place >> 32U) * kMix) >> 40U);
}

/// 32 bits of three numbers in each lane, of which the upper ones are mixed best.
template <class Int>
Int mixed_hash(const Int& a, const Int& b, const Int& c) {
  const auto factor = [](std::uint32_t odd) { return static_cast<std::int32_t>(odd); };
  const Int all = multiply(a, factor(0x9E3779B1U)) ^ multiply(b, factor(0x85EBCA77U)) ^
                  multiply(c, factor(0xC2B2AE3DU));
  return multiply(all ^ (all >> 15), factor(0x2C1B3C6DU));
}

}  // namespace dynains::detail
