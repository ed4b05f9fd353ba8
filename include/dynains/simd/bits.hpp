// Words of bits: tables by byte, for what processors without instructions of their own do bit by
// bit, and loops.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace dynains::detail {

/// A one in each of eight bytes: what it is multiplied by is in all of them.
inline constexpr std::uint64_t kInEachByte = 0x0101010101010101U;

using BytesByByte = std::array<std::array<std::uint8_t, 8>, 256>;

constexpr BytesByByte spread_bits() {
  BytesByByte bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    for (std::size_t bit = 0; bit < 8; ++bit) bytes[i][bit] = i >> bit & 1U;
  }
  return bytes;
}
/// Every bit of a byte as a byte.
inline constexpr BytesByByte kBytesOfBits = spread_bits();

constexpr BytesByByte sum_bits() {
  BytesByByte sums = spread_bits();
  for (auto& of_byte : sums) {
    for (std::size_t bit = 1; bit < 8; ++bit) {
      of_byte[bit] = static_cast<std::uint8_t>(of_byte[bit] + of_byte[bit - 1]);
    }
  }
  return sums;
}
/// How many bits of a byte are set up to each of them.
inline constexpr BytesByByte kOnesUpTo = sum_bits();

/// How many bits are set.
constexpr std::uint32_t count_ones(std::uint64_t bits) {
  bits -= bits >> 1U & 0x5555555555555555U;
  bits = (bits & 0x3333333333333333U) + (bits >> 2U & 0x3333333333333333U);
  bits = (bits + (bits >> 4U)) & 0x0F0F0F0F0F0F0F0FU;
  return static_cast<std::uint32_t>(bits * kInEachByte >> 56U);
}

constexpr BytesByByte find_bits() {
  BytesByByte places{};
  for (std::size_t i = 0; i < places.size(); ++i) {
    std::size_t found = 0;
    for (std::uint8_t bit = 0; bit < 8; ++bit) {
      if ((i >> bit & 1U) != 0) places[i][found++] = bit;
    }
  }
  return places;
}
/// Which bits of a byte are set, from the lowest on.
inline constexpr BytesByByte kPlacesOfBits = find_bits();

/// Calls `body(number)` for each bit that is set, from the lowest on.
template <class Body>
void for_each_bit(std::uint64_t bits, Body&& body) {
  for (; bits != 0; bits &= bits - 1) body(static_cast<std::size_t>(__builtin_ctzll(bits)));
}

}  // namespace dynains::detail
