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

constexpr std::array<std::uint8_t, 256> count_ones() {
  std::array<std::uint8_t, 256> ones{};
  for (std::size_t i = 0; i < ones.size(); ++i) ones[i] = kOnesUpTo[i][7];
  return ones;
}
/// Set bits of every byte, close together.
inline constexpr std::array<std::uint8_t, 256> kOnes = count_ones();

/// Writes how many of the 64 bits are set up to each of them, and returns how many are set.
inline std::uint32_t count_up_to(std::uint64_t bits, std::uint8_t* counts) {
  std::uint32_t before = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    const auto& ones = kOnesUpTo[bits >> 8 * i & 0xFFU];
    std::uint64_t eight;
    std::memcpy(&eight, ones.data(), sizeof(eight));
    eight += before * kInEachByte;
    std::memcpy(counts + 8 * i, &eight, sizeof(eight));
    before += ones[7];
  }
  return before;
}

/// Calls `body(number)` for each bit that is set, from the lowest on.
template <class Body>
void for_each_bit(std::uint64_t bits, Body&& body) {
  for (; bits != 0; bits &= bits - 1) body(static_cast<std::size_t>(__builtin_ctzll(bits)));
}

}  // namespace dynains::detail
