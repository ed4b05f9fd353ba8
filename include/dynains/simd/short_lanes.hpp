// Sixteen 16-bit integers side by side: what range images are made of. As with floats, there are
// two kinds: two vectors of eight that every processor holds in registers, and one of sixteen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "dynains/simd/shuffle.hpp"
#include "dynains/simd/wide_lanes.hpp"

namespace dynains::detail {

inline constexpr std::size_t kShortPackWidth = 16;

using Short8 = std::int16_t __attribute__((vector_size(16)));

inline Short8 min_shorts(Short8 a, Short8 b) {
#if defined(__SSE2__)
  return Short8(_mm_min_epi16(__m128i(a), __m128i(b)));
#else
  return a < b ? a : b;
#endif
}
inline bool any_short(Short8 mask) {
#if defined(__SSE2__)
  return _mm_movemask_epi8(__m128i(mask)) != 0;
#else
  std::uint64_t halves[2];
  std::memcpy(halves, &mask, sizeof(halves));
  return (halves[0] | halves[1]) != 0;
#endif
}
/// a0 b0 a1 b1 ... a7 b7.
inline void store_interleaved(std::int16_t* to, Short8 a, Short8 b) {
  Short8 low, high;
  shuffle<0, 8, 1, 9, 2, 10, 3, 11>(a, b, low);
  shuffle<4, 12, 5, 13, 6, 14, 7, 15>(a, b, high);
  std::memcpy(to, &low, sizeof(low));
  std::memcpy(to + 8, &high, sizeof(high));
}

/// Comparisons give lanes of all bits set, which is -1, or of none.
struct NarrowShort {
  Short8 lo, hi;

  NarrowShort() = default;
  NarrowShort(Short8 low, Short8 high) : lo(low), hi(high) {}
  explicit NarrowShort(std::int16_t n) : lo{n, n, n, n, n, n, n, n}, hi(lo) {}

  static NarrowShort load(const std::int16_t* from) {
    NarrowShort result;
    std::memcpy(&result.lo, from, sizeof(Short8));
    std::memcpy(&result.hi, from + 8, sizeof(Short8));
    return result;
  }
  void store(std::int16_t* to) const {
    std::memcpy(to, &lo, sizeof(Short8));
    std::memcpy(to + 8, &hi, sizeof(Short8));
  }
  void store_interleaved_with(const NarrowShort& other, std::int16_t* to) const {
    store_interleaved(to, lo, other.lo);
    store_interleaved(to + 16, hi, other.hi);
  }
  bool any() const { return any_short(lo | hi); }

  using S = NarrowShort;
  friend S operator+(const S& a, const S& b) { return {a.lo + b.lo, a.hi + b.hi}; }
  friend S operator-(const S& a, const S& b) { return {a.lo - b.lo, a.hi - b.hi}; }
  friend S operator&(const S& a, const S& b) { return {a.lo & b.lo, a.hi & b.hi}; }
  friend S operator~(const S& a) { return {~a.lo, ~a.hi}; }
  friend S operator<(const S& a, const S& b) { return {a.lo < b.lo, a.hi < b.hi}; }
  friend S operator==(const S& a, const S& b) { return {a.lo == b.lo, a.hi == b.hi}; }
  friend S min(const S& a, const S& b) { return {min_shorts(a.lo, b.lo), min_shorts(a.hi, b.hi)}; }
  friend S select(const S& mask, const S& a, const S& b) {
    return {(mask.lo & a.lo) | (~mask.lo & b.lo), (mask.hi & a.hi) | (~mask.hi & b.hi)};
  }
};

struct WideShort {
  using Vector = std::int16_t __attribute__((vector_size(32)));
  Vector v;

  WideShort() = default;
  explicit WideShort(const Vector& vector) : v(vector) {}
  explicit WideShort(std::int16_t n) { spread(n, v); }

  static WideShort load(const std::int16_t* from) {
    WideShort result;
    load_vector(from, result.v);
    return result;
  }
  void store(std::int16_t* to) const { store_vector(v, to); }
  void store_interleaved_with(const WideShort& other, std::int16_t* to) const {
    store_interleaved(to, low(v), low(other.v));
    store_interleaved(to + 16, high(v), high(other.v));
  }
  bool any() const { return any_short(low(v) | high(v)); }

  using S = WideShort;
  friend S operator+(const S& a, const S& b) { return S(a.v + b.v); }
  friend S operator-(const S& a, const S& b) { return S(a.v - b.v); }
  friend S operator&(const S& a, const S& b) { return S(a.v & b.v); }
  friend S operator~(const S& a) { return S(~a.v); }
  friend S operator<(const S& a, const S& b) { return S(a.v < b.v); }
  friend S operator==(const S& a, const S& b) { return S(a.v == b.v); }
  friend S min(const S& a, const S& b) { return S(a.v < b.v ? a.v : b.v); }
  friend S select(const S& mask, const S& a, const S& b) { return S(mask.v ? a.v : b.v); }

 private:
  static Short8 low(const Vector& a) {
    Short8 result;
    shuffle<0, 1, 2, 3, 4, 5, 6, 7>(a, a, result);
    return result;
  }
  static Short8 high(const Vector& a) {
    Short8 result;
    shuffle<8, 9, 10, 11, 12, 13, 14, 15>(a, a, result);
    return result;
  }
};

/// The sixteen that go with a kind of lanes.
template <class Packs>
struct ShortsOf;
template <>
struct ShortsOf<NarrowPacks> {
  using Type = NarrowShort;
};
template <>
struct ShortsOf<WidePacks> {
  using Type = WideShort;
};

}  // namespace dynains::detail
