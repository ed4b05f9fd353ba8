// Eight 16-bit integers side by side: what range images are made of.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace dynains::detail {

using Short8 = std::int16_t __attribute__((vector_size(16)));

inline Short8 load_shorts(const std::int16_t* from) {
  Short8 result;
  std::memcpy(&result, from, sizeof(result));
  return result;
}
inline void store_shorts(std::int16_t* to, Short8 value) { std::memcpy(to, &value, sizeof(value)); }
inline Short8 all_shorts(std::int16_t value) {
  return Short8{value, value, value, value, value, value, value, value};
}

/// `a` where the mask (the result of a comparison) is set, else `b`.
inline Short8 select_shorts(Short8 mask, Short8 a, Short8 b) { return (mask & a) | (~mask & b); }
inline Short8 min_shorts(Short8 a, Short8 b) {
#if defined(__SSE2__)
  return Short8(_mm_min_epi16(__m128i(a), __m128i(b)));
#else
  return select_shorts(a < b, a, b);
#endif
}

/// Whether any lane of a mask is set.
inline bool any_short(Short8 mask) {
#if defined(__SSE2__)
  return _mm_movemask_epi8(__m128i(mask)) != 0;
#else
  std::uint64_t halves[2];
  std::memcpy(halves, &mask, sizeof(halves));
  return (halves[0] | halves[1]) != 0;
#endif
}

inline std::int16_t least_short(Short8 a) {
  std::int16_t result = a[0];
  for (int i = 1; i < 8; ++i) result = a[i] < result ? a[i] : result;
  return result;
}

/// a0 b0 a1 b1 ... a7 b7.
inline void store_interleaved(std::int16_t* to, Short8 a, Short8 b) {
#if defined(__SSE2__)
  store_shorts(to, Short8(_mm_unpacklo_epi16(__m128i(a), __m128i(b))));
  store_shorts(to + 8, Short8(_mm_unpackhi_epi16(__m128i(a), __m128i(b))));
#else
  for (int i = 0; i < 8; ++i) {
    to[2 * i] = a[i];
    to[2 * i + 1] = b[i];
  }
#endif
}

}  // namespace dynains::detail
