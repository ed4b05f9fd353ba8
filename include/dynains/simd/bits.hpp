// Counts, loops and tables for the bits of words and bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace dynains::detail {

/// Bits of a word. Loops take so many numbers at a time, with one bit for each.
inline constexpr std::size_t kWordBits = 64;

/// Bits of half a number of 32 bits.
inline constexpr int kHalfBits = 16;

/// Eight bytes for each value of a byte.
using BytesByByte = std::array<std::array<std::uint8_t, 8>, 256>;

constexpr BytesByByte spread_bits() {
  BytesByByte bits{};
  for (std::size_t i = 0; i < bits.size(); ++i) {
    for (std::size_t bit = 0; bit < 8; ++bit) bits[i][bit] = i >> bit & 1U;
  }
  return bits;
}
/// The bits of a byte, each as a byte that is 0 or 1.
inline constexpr BytesByByte kBytesOfBits = spread_bits();

/// Number of set bits. Without -mpopcnt, the builtin function would call a library function.
constexpr std::uint32_t count_ones(std::uint64_t bits) {
  bits -= bits >> 1U & 0x5555555555555555U;
  bits = (bits & 0x3333333333333333U) + (bits >> 2U & 0x3333333333333333U);
  bits = (bits + (bits >> 4U)) & 0x0F0F0F0F0F0F0F0FU;
  return static_cast<std::uint32_t>(bits * 0x0101010101010101U >> 56U);
}

/// Calls `body(index)` for each set bit in ascending order.
template <class Body>
void for_each_bit(std::uint64_t bits, Body&& body) {
  for (; bits != 0; bits &= bits - 1) body(static_cast<std::size_t>(__builtin_ctzll(bits)));
}

}  // namespace dynains::detail
