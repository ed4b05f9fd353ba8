// Eight floats side by side, written as two four-wide vectors so that the baseline instruction set
// of x86-64 (and of AArch64) holds them in registers. Every operation is exactly rounded IEEE
// arithmetic: the same lanes give the same bits on every compiler and every instruction set, as
// long as the compiler does not contract multiplications and additions.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "dynains/points.hpp"

namespace dynains::detail {

inline constexpr std::size_t kPackWidth = 8;
/// Of those in wide_lanes.hpp: so many places behind their end, buffers are read and written.
inline constexpr std::size_t kMaxPackWidth = 16;

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));

/// Result of a comparison: all bits of a lane set, or none.
struct Mask8 {
  Int4 lo, hi;

  friend Mask8 operator&(Mask8 a, Mask8 b) { return {a.lo & b.lo, a.hi & b.hi}; }
  friend Mask8 operator^(Mask8 a, Mask8 b) { return {a.lo ^ b.lo, a.hi ^ b.hi}; }
  friend Mask8 operator|(Mask8 a, Mask8 b) { return {a.lo | b.lo, a.hi | b.hi}; }
  friend Mask8 operator~(Mask8 a) { return {~a.lo, ~a.hi}; }

  /// Lane i as bit i.
  unsigned bits() const {
#if defined(__SSE2__)
    const __m128i words = _mm_packs_epi32(__m128i(lo), __m128i(hi));
    return static_cast<unsigned>(_mm_movemask_epi8(_mm_packs_epi16(words, words))) & 0xFFU;
#else
    unsigned result = 0;
    for (int i = 0; i < 4; ++i) {
      // By themselves: in one expression, UBSan of GCC 12 reads another lane than it shifts by.
      const bool low = lo[i] != 0;
      const bool high = hi[i] != 0;
      result |= unsigned{low} << i | unsigned{high} << (i + 4);
    }
    return result;
#endif
  }
};

struct Int8 {
  Int4 lo, hi;

  Int8() = default;
  Int8(Int4 low, Int4 high) : lo(low), hi(high) {}
  explicit Int8(std::int32_t value)
      : lo{value, value, value, value}, hi{value, value, value, value} {}

  static Int8 load(const std::int32_t* from) {
    Int8 result;
    std::memcpy(&result.lo, from, sizeof(Int4));
    std::memcpy(&result.hi, from + 4, sizeof(Int4));
    return result;
  }
  void store(std::int32_t* to) const {
    std::memcpy(to, &lo, sizeof(Int4));
    std::memcpy(to + 4, &hi, sizeof(Int4));
  }

  friend Int8 operator+(Int8 a, Int8 b) { return {a.lo + b.lo, a.hi + b.hi}; }
  friend Int8 operator-(Int8 a, Int8 b) { return {a.lo - b.lo, a.hi - b.hi}; }
  friend Int8 operator<<(Int8 a, int bits) { return {a.lo << bits, a.hi << bits}; }
  friend Int8 operator>>(Int8 a, int bits) { return {a.lo >> bits, a.hi >> bits}; }  // of the sign
  friend Int8 operator&(Int8 a, Int8 b) { return {a.lo & b.lo, a.hi & b.hi}; }
  friend Int8 operator^(Int8 a, Int8 b) { return {a.lo ^ b.lo, a.hi ^ b.hi}; }
  friend Mask8 operator<(Int8 a, Int8 b) { return {a.lo < b.lo, a.hi < b.hi}; }
  friend Mask8 operator==(Int8 a, Int8 b) { return {a.lo == b.lo, a.hi == b.hi}; }
};

/// The same value in all lanes, kept in memory: cheaper than to spread it anew in every round of a
/// loop that has no register left for it.
struct PackConstant {
  alignas(64) float values[kMaxPackWidth];
  constexpr PackConstant(float value)
      : values{value, value, value, value, value, value, value, value,
               value, value, value, value, value, value, value, value} {}

  /// What has to be flipped (operator^) to turn this one into `other`.
  PackConstant bits_changed(const PackConstant& other) const {
    std::uint32_t a, b;
    std::memcpy(&a, values, sizeof(a));
    std::memcpy(&b, other.values, sizeof(b));
    a ^= b;
    float bits;
    std::memcpy(&bits, &a, sizeof(bits));
    return PackConstant(bits);
  }
};

struct Float8 {
  Float4 lo, hi;

  Float8() = default;
  Float8(Float4 low, Float4 high) : lo(low), hi(high) {}
  Float8(const PackConstant& constant) : Float8(load(constant.values)) {}
  explicit Float8(float value) : lo{value, value, value, value}, hi{value, value, value, value} {}

  static Float8 load(const float* from) {
    Float8 result;
    std::memcpy(&result.lo, from, sizeof(Float4));
    std::memcpy(&result.hi, from + 4, sizeof(Float4));
    return result;
  }
  void store(float* to) const {
    std::memcpy(to, &lo, sizeof(Float4));
    std::memcpy(to + 4, &hi, sizeof(Float4));
  }

  friend Float8 operator+(Float8 a, Float8 b) { return {a.lo + b.lo, a.hi + b.hi}; }
  friend Float8 operator-(Float8 a, Float8 b) { return {a.lo - b.lo, a.hi - b.hi}; }
  friend Float8 operator*(Float8 a, Float8 b) { return {a.lo * b.lo, a.hi * b.hi}; }
  friend Float8 operator/(Float8 a, Float8 b) { return {a.lo / b.lo, a.hi / b.hi}; }
  friend Mask8 operator<(Float8 a, Float8 b) { return {a.lo < b.lo, a.hi < b.hi}; }
  friend Mask8 operator<=(Float8 a, Float8 b) { return {a.lo <= b.lo, a.hi <= b.hi}; }
  friend Mask8 operator>(Float8 a, Float8 b) { return {a.lo > b.lo, a.hi > b.hi}; }
  friend Mask8 operator>=(Float8 a, Float8 b) { return {a.lo >= b.lo, a.hi >= b.hi}; }
};

inline Int4 bits_of(Float4 a) { return Int4(a); }
inline Mask8 bits_of(Float8 a) { return {Int4(a.lo), Int4(a.hi)}; }
inline Float8 float_of(Mask8 a) { return {Float4(a.lo), Float4(a.hi)}; }

/// `a` where the mask is set, else `b`.
inline Float8 select(Mask8 mask, Float8 a, Float8 b) {
  return {Float4((mask.lo & bits_of(a.lo)) | (~mask.lo & bits_of(b.lo))),
          Float4((mask.hi & bits_of(a.hi)) | (~mask.hi & bits_of(b.hi)))};
}
inline Int8 select(Mask8 mask, Int8 a, Int8 b) {
  return {(mask.lo & a.lo) | (~mask.lo & b.lo), (mask.hi & a.hi) | (~mask.hi & b.hi)};
}
/// `a` where the mask is set, else zero: one instruction cheaper than select.
inline Float8 keep(Mask8 mask, Float8 a) {
  return {Float4(mask.lo & bits_of(a.lo)), Float4(mask.hi & bits_of(a.hi))};
}

inline Int8 keep(Mask8 mask, Int8 a) { return {mask.lo & a.lo, mask.hi & a.hi}; }

/// The second operand where either is NaN, as the SSE instruction has it.
inline Float8 min(Float8 a, Float8 b) {
#if defined(__SSE2__)
  return {_mm_min_ps(a.lo, b.lo), _mm_min_ps(a.hi, b.hi)};
#else
  return select(a < b, a, b);
#endif
}
inline Float8 max(Float8 a, Float8 b) {
#if defined(__SSE2__)
  return {_mm_max_ps(a.lo, b.lo), _mm_max_ps(a.hi, b.hi)};
#else
  return select(a > b, a, b);
#endif
}

inline Float4 sqrt(Float4 a) {
#if defined(__SSE2__)
  return _mm_sqrt_ps(a);
#else
  return Float4{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])};
#endif
}
inline Float8 sqrt(Float8 a) { return {sqrt(a.lo), sqrt(a.hi)}; }

inline Float8 abs(Float8 a) {
  const Int4 magnitude = {0x7FFFFFFF, 0x7FFFFFFF, 0x7FFFFFFF, 0x7FFFFFFF};
  return {Float4(bits_of(a.lo) & magnitude), Float4(bits_of(a.hi) & magnitude)};
}

/// `a`, negated where `sign` is negative or -0.
template <class Float>
Float with_sign_of(const Float& sign, const Float& a) {
  static constexpr PackConstant kSign(-0.0F);
  return float_of(bits_of(a) ^ (bits_of(sign) & bits_of(Float(kSign))));
}

/// Rounds towards zero; lanes must lie within the range of int32.
inline Int8 truncate(Float8 a) {
  return {__builtin_convertvector(a.lo, Int4), __builtin_convertvector(a.hi, Int4)};
}
inline Float8 to_float(Int8 a) {
  return {__builtin_convertvector(a.lo, Float4), __builtin_convertvector(a.hi, Float4)};
}

/// Product modulo 2^32.
inline Int8 multiply(Int8 a, std::int32_t factor) {
  using Unsigned4 =
      std::uint32_t __attribute__((vector_size(16)));  // signed ones must not overflow
  const auto f = static_cast<std::uint32_t>(factor);
  return {Int4(Unsigned4(a.lo) * f), Int4(Unsigned4(a.hi) * f)};
}

/// Rounds down; lanes must lie within the range of int32.
inline Int8 floor(Float8 a) {
  const Int8 whole = truncate(a);
  const Mask8 above = to_float(whole) > a;  // all bits set is -1
  return whole + Int8(above.lo, above.hi);
}

/// Sum in a fixed order.
inline float sum(Float8 a) {
  const Float4 s = a.lo + a.hi;
  return (s[0] + s[2]) + (s[1] + s[3]);
}
template <class Float>
float min_lane(const Float& a) {
  float v[sizeof(Float) / sizeof(float)];
  a.store(v);
  float result = v[0];
  for (std::size_t i = 1; i < sizeof(Float) / sizeof(float); ++i)
    result = v[i] < result ? v[i] : result;
  return result;
}
template <class Float>
float max_lane(const Float& a) {
  float v[sizeof(Float) / sizeof(float)];
  a.store(v);
  float result = v[0];
  for (std::size_t i = 1; i < sizeof(Float) / sizeof(float); ++i)
    result = v[i] > result ? v[i] : result;
  return result;
}

/// Bit i is set where byte i of the 64 that begin at `from` is not zero.
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

/// The same of up to 64 bytes; zeros behind them.
inline std::uint64_t nonzero_bytes(const std::uint8_t* from, std::size_t count) {
  constexpr std::size_t kAll = 64;
  if (count == kAll) return nonzero_bytes(from);
  std::uint8_t padded[kAll] = {};
  std::memcpy(padded, from, count);
  return nonzero_bytes(padded);
}

}  // namespace dynains::detail
