// Counts, loops and tables for the bits of words and bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace dynains::detail {

/// Each byte is 1. The product with a byte repeats that byte eight times.
inline constexpr std::uint64_t kInEachByte = 0x0101010101010101U;

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

constexpr BytesByByte find_bits() {
  BytesByByte indices{};
  for (std::size_t i = 0; i < indices.size(); ++i) {
    std::size_t found = 0;
    for (std::uint8_t bit = 0; bit < 8; ++bit) {
      if ((i >> bit & 1U) != 0) indices[i][found++] = bit;
    }
  }
  return indices;
}
/// Indices of the set bits of a byte in ascending order, then zeros.
inline constexpr BytesByByte kIndicesOfBits = find_bits();

/// Number of set bits. Without -mpopcnt, the builtin function would call a library function.
constexpr std::uint32_t count_ones(std::uint64_t bits) {
  bits -= bits >> 1U & 0x5555555555555555U;
  bits = (bits & 0x3333333333333333U) + (bits >> 2U & 0x3333333333333333U);
  bits = (bits + (bits >> 4U)) & 0x0F0F0F0F0F0F0F0FU;
  return static_cast<std::uint32_t>(bits * kInEachByte >> 56U);
}

/// Calls `body(index)` for each set bit in ascending order.
template <class Body>
void for_each_bit(std::uint64_t bits, Body&& body) {
  for (; bits != 0; bits &= bits - 1) body(static_cast<std::size_t>(__builtin_ctzll(bits)));
}

/// Bit i is set if byte i of the 64 bytes from `from` on is not zero.
inline std::uint64_t nonzero_bytes(const std::uint8_t* from) {
  std::uint64_t result = 0;
#if defined(__SSE2__)
  for (int i = 0; i < 4; ++i) {
    const __m128i bytes = _mm_loadu_si128(reinterpret_cast<const __m128i*>(from) + i);
    const int zero = _mm_movemask_epi8(_mm_cmpeq_epi8(bytes, _mm_setzero_si128()));
    result |= static_cast<std::uint64_t>(~zero & 0xFFFF) << (16 * i);
  }
#else
  for (int i = 0; i < 64; ++i) result |= std::uint64_t{from[i] != 0} << i;
#endif
  return result;
}

/// Bits of the first `count` bytes, at most 64; the higher bits are 0.
inline std::uint64_t nonzero_bytes(const std::uint8_t* from, std::size_t count) {
  constexpr std::size_t kAll = 64;
  if (count == kAll) return nonzero_bytes(from);
  std::uint8_t padded[kAll] = {};
  std::memcpy(padded, from, count);
  return nonzero_bytes(padded);
}

}  // namespace dynains::detail
