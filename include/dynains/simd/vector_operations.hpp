// Vectors of eight and sixteen numbers of 32 bits, and what they have no operator for, or none that
// the compiler translates well. By reference: no vector passes the border to code that is compiled
// for other registers.
#pragma once

#include <cstdint>

#include "dynains/simd/lanes.hpp"
#include "dynains/simd/shuffle.hpp"

namespace dynains::detail {

// Where nothing is inlined, GCC 12 does not align all that a function returns as wide vectors want
// it: they are taken as they lie.
using Ints8 = std::int32_t __attribute__((vector_size(32), aligned(16)));
using Floats8 = float __attribute__((vector_size(32), aligned(16)));
using Ints16 = std::int32_t __attribute__((vector_size(64), aligned(16)));
using Floats16 = float __attribute__((vector_size(64), aligned(16)));

template <int kCount>
struct Vectors;
template <>
struct Vectors<8> {
  using Ints = Ints8;
  using Unsigned = std::uint32_t __attribute__((vector_size(32), aligned(16)));
  using Floats = Floats8;
};
template <>
struct Vectors<16> {
  using Ints = Ints16;
  using Unsigned = std::uint32_t __attribute__((vector_size(64), aligned(16)));
  using Floats = Floats16;
};

// Bytes that are copied, as by memcpy, go by halves over the stack wherever GCC may use AVX2 all
// over: what is loaded as a whole then waits for both. So vectors are read and written as such.
template <class Vector>
struct [[gnu::packed, gnu::may_alias]] AnyPlace {
  Vector vector;
};
template <class Vector>
void load_vector(const void* from, Vector& to) {
  to = static_cast<const AnyPlace<Vector>*>(from)->vector;
}
template <class Vector>
void store_vector(const Vector& from, void* to) {
  static_cast<AnyPlace<Vector>*>(to)->vector = from;
}

// Comparisons set all bits of a lane, or none. These are for any vector; where GCC makes something
// else of them than one instruction, there are others below.
template <class Vector, class Mask>
void compare_less(const Vector& a, const Vector& b, Mask& result) {
  result = a < b;
}
template <class Vector, class Mask>
void compare_at_most(const Vector& a, const Vector& b, Mask& result) {
  result = a <= b;
}
template <class Vector, class Mask>
void compare_equal(const Vector& a, const Vector& b, Mask& result) {
  result = a == b;
}
template <class Mask, class Vector>
void choose(const Mask& mask, const Vector& a, const Vector& b, Vector& result) {
  result = mask ? a : b;
}
/// The second one where either is NaN.
template <class Vector>
void take_lesser(const Vector& a, const Vector& b, Vector& result) {
  result = a < b ? a : b;
}
template <class Vector>
void take_greater(const Vector& a, const Vector& b, Vector& result) {
  result = a > b ? a : b;
}
template <class Vector>
void multiply_by(const Vector& factor, Vector& of) {
  of *= factor;
}

/// Brings the numbers whose bits are set to the front; behind them is anything. For sixteen only.
template <class Vector>
void compress(unsigned bits, Vector& of);

#if defined(__x86_64__) && defined(__SSE2__) && !defined(__clang__)
[[gnu::target("avx2")]] inline unsigned sign_bits(const Ints8& of) {
  return static_cast<unsigned>(__builtin_ia32_movmskps256(Floats8(of)));
}
[[gnu::target("avx2")]] inline void take_root(Floats8& of) { of = __builtin_ia32_sqrtps256(of); }
[[gnu::target("avx2")]] inline void take_lesser(const Floats8& a, const Floats8& b,
                                                Floats8& result) {
  result = __builtin_ia32_minps256(a, b);
}
[[gnu::target("avx2")]] inline void take_greater(const Floats8& a, const Floats8& b,
                                                 Floats8& result) {
  result = __builtin_ia32_maxps256(a, b);
}
// Elsewhere, GCC puts equal numbers together one by one.
template <class Number, class Vector>
[[gnu::target("avx2")]] void spread(Number n, Vector& to) {
  to = Vector{} + n;
}
#else
// Clang does not inline a function for AVX2 into a lambda that is not, and does better by halves.
inline unsigned sign_bits(const Ints8& of) {
  Mask8 halves;
  shuffle<0, 1, 2, 3>(of, of, halves.lo);
  shuffle<4, 5, 6, 7>(of, of, halves.hi);
  return halves.bits();
}
inline void take_root(Floats8& of) {
  Float4 low, high;
  shuffle<0, 1, 2, 3>(of, of, low);
  shuffle<4, 5, 6, 7>(of, of, high);
  shuffle<0, 1, 2, 3, 4, 5, 6, 7>(sqrt(low), sqrt(high), of);
}
template <class Number, class Vector>
void spread(Number n, Vector& to) {
  to = Vector{} + n;
}
#endif

#if defined(__x86_64__) && defined(__SSE2__) && !defined(__clang__) && __GNUC__ >= 12
/// Whether there is code for sixteen lanes.
inline constexpr bool kHasSixteen = true;

// Masks have registers of their own there, which GCC knows of within such functions only; elsewhere
// it compares number by number. A product of its own cannot be contracted with a sum: with or
// without this instruction set, what is computed is the same.
#pragma GCC push_options
#pragma GCC target("avx512f,avx512bw,avx512dq,avx512vl")
inline unsigned sign_bits(const Ints16& of) {
  return static_cast<unsigned>(__builtin_ia32_cvtd2mask512(of));
}
inline void take_root(Floats16& of) { of = __builtin_ia32_sqrtps512_mask(of, of, -1, 4); }
inline void spread(float n, Floats16& to) { to = Floats16{} + n; }
inline void spread(std::int32_t n, Ints16& to) { to = Ints16{} + n; }
inline void multiply_by(const Floats16& factor, Floats16& of) {
  of = __builtin_ia32_mulps512_mask(of, factor, of, -1, 4);
}
inline void compare_less(const Floats16& a, const Floats16& b, Ints16& result) { result = a < b; }
inline void compare_less(const Ints16& a, const Ints16& b, Ints16& result) { result = a < b; }
inline void compare_at_most(const Floats16& a, const Floats16& b, Ints16& result) {
  result = a <= b;
}
inline void compare_equal(const Ints16& a, const Ints16& b, Ints16& result) { result = a == b; }
inline void choose(const Ints16& mask, const Floats16& a, const Floats16& b, Floats16& result) {
  result = mask ? a : b;
}
inline void choose(const Ints16& mask, const Ints16& a, const Ints16& b, Ints16& result) {
  result = mask ? a : b;
}
inline void take_lesser(const Floats16& a, const Floats16& b, Floats16& result) {
  result = __builtin_ia32_minps512_mask(a, b, a, -1, 4);
}
inline void take_greater(const Floats16& a, const Floats16& b, Floats16& result) {
  result = __builtin_ia32_maxps512_mask(a, b, a, -1, 4);
}
inline void compress(unsigned bits, Floats16& of) {
  of = __builtin_ia32_compresssf512_mask(of, of, static_cast<std::uint16_t>(bits));
}
inline void compress(unsigned bits, Ints16& of) {
  of = __builtin_ia32_compresssi512_mask(of, of, static_cast<std::uint16_t>(bits));
}
#pragma GCC pop_options
#else
inline constexpr bool kHasSixteen = false;
#endif

}  // namespace dynains::detail
