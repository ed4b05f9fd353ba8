// Packs of numbers in vector registers. Each operation is exactly rounded IEEE arithmetic: results
// are equal bit by bit for all widths, compilers and instruction sets, unless the compiler
// contracts multiplications and additions.
//
// Functions of registers take them by reference: AVX2 code and baseline code pass 32-byte vectors
// by value in different ways.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace dynains::detail {

template <class T, int kWidth>
struct Register {
  // Aligned to 16 bytes, since GCC 12 gives returned vectors no more where it does not inline.
  typedef T Vector __attribute__((vector_size(kWidth * sizeof(T)), aligned(16)));
  Vector v;
};

/// Number type of the mask that a comparison returns: -1 where it is true, else 0.
template <class T>
struct MaskNumberOf {
  using Type = T;
};
template <>
struct MaskNumberOf<float> {
  using Type = std::int32_t;
};
template <class T>
using MaskNumber = typename MaskNumberOf<T>::Type;

// Registers are loaded and stored as a whole. With -mavx2, GCC makes two halves of a memcpy, and a
// later load of the whole vector must then wait for both stores.
template <class T, int kWidth>
struct [[gnu::packed, gnu::may_alias]] UnalignedRegister {
  typename Register<T, kWidth>::Vector v;
};
template <class T, int kWidth>
void load(const void* from, Register<T, kWidth>& to) {
  to.v = static_cast<const UnalignedRegister<T, kWidth>*>(from)->v;
}
template <class T, int kWidth>
void store(const Register<T, kWidth>& from, void* to) {
  static_cast<UnalignedRegister<T, kWidth>*>(to)->v = from.v;
}

/// Selects numbers of `a` (indices 0 to kWidth - 1) and `b` (indices kWidth to 2 kWidth - 1).
template <int... kIndices, class T, int kWidth, int kResultWidth>
void shuffle(const Register<T, kWidth>& a, const Register<T, kWidth>& b,
             Register<T, kResultWidth>& result) {
#if defined(__clang__) || __GNUC__ >= 12
  result.v = __builtin_shufflevector(a.v, b.v, kIndices...);
#else
  result.v = typename Register<T, kResultWidth>::Vector{
      (kIndices < kWidth ? a.v[kIndices % kWidth] : b.v[kIndices % kWidth])...};
#endif
}

/// The lower (0) or upper (1) half of 32 bytes.
template <int kHalf, class T, int kWidth, int... k>
Register<T, kWidth / 2> half_of(const Register<T, kWidth>& a, std::integer_sequence<int, k...>) {
  Register<T, kWidth / 2> result;
  shuffle<(kHalf * kWidth / 2 + k)...>(a, a, result);
  return result;
}
template <int kHalf, class T, int kWidth>
Register<T, kWidth / 2> half_of(const Register<T, kWidth>& a) {
  return half_of<kHalf>(a, std::make_integer_sequence<int, kWidth / 2>());
}

using Floats4 = Register<float, 4>;
using Floats8 = Register<float, 8>;
using Ints4 = Register<std::int32_t, 4>;
using Ints8 = Register<std::int32_t, 8>;
using Shorts8 = Register<std::int16_t, 8>;
using Shorts16 = Register<std::int16_t, 16>;
// Completes the types: GCC 12 has an internal error if an AVX2 function does it first.
static_assert(sizeof(Floats8) == 32 && sizeof(Ints8) == 32 && sizeof(Shorts16) == 32);

// Operations for all registers; overloads for some of them follow.
template <class T, int kWidth>
void broadcast(T number, Register<T, kWidth>& to) {
  to.v = number - typename Register<T, kWidth>::Vector{};  // -0 + 0 would be 0
}
/// `a` where the mask is set, else `b`.
template <class T, int kWidth>
void choose(const Register<MaskNumber<T>, kWidth>& mask, const Register<T, kWidth>& a,
            const Register<T, kWidth>& b, Register<T, kWidth>& result) {
  if constexpr (kWidth * sizeof(T) == 16) {  // SSE2 has no blend instruction
    using Bits = typename Register<MaskNumber<T>, kWidth>::Vector;
    result.v = typename Register<T, kWidth>::Vector((mask.v & Bits(a.v)) | (~mask.v & Bits(b.v)));
  } else {
    result.v = mask.v ? a.v : b.v;
  }
}
/// The lesser number; `b` if either is NaN.
template <class T, int kWidth>
void take_lesser(const Register<T, kWidth>& a, const Register<T, kWidth>& b,
                 Register<T, kWidth>& result) {
  result.v = a.v < b.v ? a.v : b.v;
}
template <class T, int kWidth>
void take_greater(const Register<T, kWidth>& a, const Register<T, kWidth>& b,
                  Register<T, kWidth>& result) {
  result.v = a.v > b.v ? a.v : b.v;
}

#if defined(__SSE2__)
inline void take_lesser(const Floats4& a, const Floats4& b, Floats4& result) {
  result.v = _mm_min_ps(a.v, b.v);
}
inline void take_greater(const Floats4& a, const Floats4& b, Floats4& result) {
  result.v = _mm_max_ps(a.v, b.v);
}
inline void take_lesser(const Shorts8& a, const Shorts8& b, Shorts8& result) {
  result.v = Shorts8::Vector(_mm_min_epi16(__m128i(a.v), __m128i(b.v)));
}
inline void take_root(const Floats4& a, Floats4& root) { root.v = _mm_sqrt_ps(a.v); }
/// Number i as bit i: whether it is negative.
inline unsigned sign_bits(const Ints4& a) {
  return static_cast<unsigned>(_mm_movemask_ps(__m128(a.v)));
}
/// Whether any number of the mask is set.
inline bool any(const Shorts8& mask) { return _mm_movemask_epi8(__m128i(mask.v)) != 0; }
#else
inline void take_root(const Floats4& a, Floats4& root) {
  for (int i = 0; i < 4; ++i) root.v[i] = std::sqrt(a.v[i]);
}
inline unsigned sign_bits(const Ints4& a) {
  unsigned result = 0;
  for (int i = 0; i < 4; ++i) {
    const bool is_set = a.v[i] < 0;  // one expression is compiled wrongly by UBSan of GCC 12
    result |= unsigned{is_set} << i;
  }
  return result;
}
inline bool any(const Shorts8& mask) {
  bool result = false;
  for (int i = 0; i < 8; ++i) result |= mask.v[i] != 0;
  return result;
}
#endif

#if defined(__x86_64__) && defined(__SSE2__) && !defined(__clang__)
// Outside AVX2 functions, GCC compiles these operations number by number.
#pragma GCC push_options
#pragma GCC target("avx2")
inline void broadcast(float number, Floats8& to) { to.v = number - Floats8::Vector{}; }
inline void broadcast(std::int32_t number, Ints8& to) { to.v = number - Ints8::Vector{}; }
inline void broadcast(std::int16_t number, Shorts16& to) { to.v = number - Shorts16::Vector{}; }
inline void take_lesser(const Floats8& a, const Floats8& b, Floats8& result) {
  result.v = __builtin_ia32_minps256(a.v, b.v);
}
inline void take_greater(const Floats8& a, const Floats8& b, Floats8& result) {
  result.v = __builtin_ia32_maxps256(a.v, b.v);
}
inline void take_root(const Floats8& a, Floats8& root) { root.v = __builtin_ia32_sqrtps256(a.v); }
inline unsigned sign_bits(const Ints8& a) {
  return static_cast<unsigned>(__builtin_ia32_movmskps256(Floats8::Vector(a.v)));
}
#pragma GCC pop_options
#else
// Clang does not inline AVX2 functions into lambdas, but compiles operations on halves well.
inline void take_root(const Floats8& a, Floats8& root) {
  Floats4 low, high;
  take_root(half_of<0>(a), low);
  take_root(half_of<1>(a), high);
  shuffle<0, 1, 2, 3, 4, 5, 6, 7>(low, high, root);
}
inline unsigned sign_bits(const Ints8& a) {
  return sign_bits(half_of<0>(a)) | sign_bits(half_of<1>(a)) << 4;
}
#endif

inline constexpr std::size_t kPackWidth = 8;        ///< 32-bit numbers in the packs of with_packs
inline constexpr std::size_t kShortPackWidth = 16;  ///< 16-bit numbers in these packs

/// One number, repeated for a pack. It stays in memory, for loops that need all registers.
struct PackConstant {
  alignas(32) float values[kPackWidth];
  constexpr PackConstant(float value)
      : values{value, value, value, value, value, value, value, value} {}
};

/// Calls `operation(r, x...)` for each register of the result and the registers of `packs` at the
/// same place.
template <class Result, class Operation, class... Packs>
Result by_parts(const Operation& operation, const Packs&... packs) {
  Result result;
  for (int i = 0; i < Result::kPartCount; ++i) operation(result.part[i], packs.part[i]...);
  return result;
}

/// `kWidth` numbers of type T (float, int32, int16) in `kParts` registers. A comparison returns a
/// mask: a pack of integers that are -1 where it is true, else 0.
template <class T, int kWidth, int kParts>
struct Pack {
  using Mask = Pack<MaskNumber<T>, kWidth, kParts>;
  static constexpr int kPartCount = kParts;
  static constexpr int kPartWidth = kWidth / kParts;

  Register<T, kPartWidth> part[kParts];

  Pack() = default;
  explicit Pack(T number) {
    for (auto& p : part) broadcast(number, p);
  }
  Pack(const PackConstant& constant) : Pack(load(constant.values)) {}

  static Pack load(const T* from) {
    Pack result;
    for (int i = 0; i < kParts; ++i) detail::load(from + i * kPartWidth, result.part[i]);
    return result;
  }
  void store(T* to) const {
    for (int i = 0; i < kParts; ++i) detail::store(part[i], to + i * kPartWidth);
  }

  friend Pack operator+(const Pack& a, const Pack& b) {
    return by_parts<Pack>([](auto& r, auto& x, auto& y) { r.v = x.v + y.v; }, a, b);
  }
  friend Pack operator-(const Pack& a, const Pack& b) {
    return by_parts<Pack>([](auto& r, auto& x, auto& y) { r.v = x.v - y.v; }, a, b);
  }
  friend Pack operator*(const Pack& a, const Pack& b) {
    return by_parts<Pack>([](auto& r, auto& x, auto& y) { r.v = x.v * y.v; }, a, b);
  }
  friend Pack operator/(const Pack& a, const Pack& b) {
    return by_parts<Pack>([](auto& r, auto& x, auto& y) { r.v = x.v / y.v; }, a, b);
  }

  // For integers and masks only.
  friend Pack operator&(const Pack& a, const Pack& b) {
    return by_parts<Pack>([](auto& r, auto& x, auto& y) { r.v = x.v & y.v; }, a, b);
  }
  friend Pack operator|(const Pack& a, const Pack& b) {
    return by_parts<Pack>([](auto& r, auto& x, auto& y) { r.v = x.v | y.v; }, a, b);
  }
  friend Pack operator^(const Pack& a, const Pack& b) {
    return by_parts<Pack>([](auto& r, auto& x, auto& y) { r.v = x.v ^ y.v; }, a, b);
  }
  friend Pack operator~(const Pack& a) {
    return by_parts<Pack>([](auto& r, auto& x) { r.v = ~x.v; }, a);
  }
  friend Pack operator<<(const Pack& a, int bits) {
    return by_parts<Pack>([bits](auto& r, auto& x) { r.v = x.v << bits; }, a);
  }
  /// Shifts the sign in.
  friend Pack operator>>(const Pack& a, int bits) {
    return by_parts<Pack>([bits](auto& r, auto& x) { r.v = x.v >> bits; }, a);
  }

  friend Mask operator<(const Pack& a, const Pack& b) {
    return by_parts<Mask>([](auto& r, auto& x, auto& y) { r.v = x.v < y.v; }, a, b);
  }
  friend Mask operator<=(const Pack& a, const Pack& b) {
    return by_parts<Mask>([](auto& r, auto& x, auto& y) { r.v = x.v <= y.v; }, a, b);
  }
  friend Mask operator==(const Pack& a, const Pack& b) {
    return by_parts<Mask>([](auto& r, auto& x, auto& y) { r.v = x.v == y.v; }, a, b);
  }
  friend Mask operator>(const Pack& a, const Pack& b) { return b < a; }
  friend Mask operator>=(const Pack& a, const Pack& b) { return b <= a; }

  /// `a` where the mask is set, else `b`.
  friend Pack select(const Mask& mask, const Pack& a, const Pack& b) {
    return by_parts<Pack>([](auto& r, auto& m, auto& x, auto& y) { choose(m, x, y, r); }, mask, a,
                          b);
  }
  /// The lesser number; `b` where either is NaN.
  friend Pack min(const Pack& a, const Pack& b) {
    return by_parts<Pack>([](auto& r, auto& x, auto& y) { take_lesser(x, y, r); }, a, b);
  }
  friend Pack max(const Pack& a, const Pack& b) {
    return by_parts<Pack>([](auto& r, auto& x, auto& y) { take_greater(x, y, r); }, a, b);
  }

  /// Bit i is set if number i is negative; for a mask, if it is set.
  unsigned bits() const {
    unsigned result = 0;
    for (int i = 0; i < kParts; ++i) result |= sign_bits(part[i]) << (i * kPartWidth);
    return result;
  }
  /// The lower (0) or upper (1) half of 32 bytes.
  template <int kHalf>
  auto half() const {
    if constexpr (kParts == 2) {
      return part[kHalf];
    } else {
      return half_of<kHalf>(part[0]);
    }
  }
  /// Whether any number of a mask of 32 bytes is set.
  bool any() const {
    auto either = half<0>();
    either.v |= half<1>().v;
    return detail::any(either);
  }
  /// Stores a0 b0 a1 b1 ... of this pack a and the other pack b.
  void store_interleaved_with(const Pack& other, std::int16_t* to) const {
    store_interleaved(half<0>(), other.template half<0>(), to);
    store_interleaved(half<1>(), other.template half<1>(), to + kWidth);
  }

 private:
  static void store_interleaved(const Register<std::int16_t, 8>& a,
                                const Register<std::int16_t, 8>& b, std::int16_t* to) {
    Register<std::int16_t, 8> low, high;
    shuffle<0, 8, 1, 9, 2, 10, 3, 11>(a, b, low);
    shuffle<4, 12, 5, 13, 6, 14, 7, 15>(a, b, high);
    detail::store(low, to);
    detail::store(high, to + 8);
  }
};

// W: width, P: number of parts.
template <int W, int P>
using FloatPack = Pack<float, W, P>;
template <int W, int P>
using IntPack = Pack<std::int32_t, W, P>;

/// Rounds towards zero. Numbers must be in the range of int32.
template <int W, int P>
IntPack<W, P> truncate(const FloatPack<W, P>& a) {
  return by_parts<IntPack<W, P>>(
      [](auto& r, auto& x) { r.v = __builtin_convertvector(x.v, decltype(r.v)); }, a);
}
template <int W, int P>
FloatPack<W, P> to_float(const IntPack<W, P>& a) {
  return by_parts<FloatPack<W, P>>(
      [](auto& r, auto& x) { r.v = __builtin_convertvector(x.v, decltype(r.v)); }, a);
}
/// Rounds down. Numbers must be in the range of int32.
template <int W, int P>
IntPack<W, P> floor(const FloatPack<W, P>& a) {
  const IntPack<W, P> whole = truncate(a);
  return whole + (a < to_float(whole));
}

/// The bits of each float as an integer.
template <int W, int P>
IntPack<W, P> bits_of(const FloatPack<W, P>& a) {
  return by_parts<IntPack<W, P>>([](auto& r, auto& x) { r.v = decltype(r.v)(x.v); }, a);
}
template <int W, int P>
FloatPack<W, P> float_of(const IntPack<W, P>& a) {
  return by_parts<FloatPack<W, P>>([](auto& r, auto& x) { r.v = decltype(r.v)(x.v); }, a);
}

/// `a` where the mask is set, else zero.
template <int W, int P>
FloatPack<W, P> keep(const IntPack<W, P>& mask, const FloatPack<W, P>& a) {
  return float_of(mask & bits_of(a));
}

template <int W, int P>
FloatPack<W, P> abs(const FloatPack<W, P>& a) {
  return float_of(bits_of(a) & IntPack<W, P>(0x7FFFFFFF));
}
/// `a`, negated where the sign bit of `sign` is set.
template <int W, int P>
FloatPack<W, P> with_sign_of(const FloatPack<W, P>& sign, const FloatPack<W, P>& a) {
  static constexpr PackConstant kSign(-0.0F);
  return float_of(bits_of(a) ^ (bits_of(sign) & bits_of(FloatPack<W, P>(kSign))));
}
template <int W, int P>
FloatPack<W, P> sqrt(const FloatPack<W, P>& a) {
  return by_parts<FloatPack<W, P>>([](auto& r, auto& x) { take_root(x, r); }, a);
}
/// Product modulo 2^32.
template <int W, int P>
IntPack<W, P> multiply(const IntPack<W, P>& a, std::int32_t factor) {
  using Unsigned = typename Register<std::uint32_t, W / P>::Vector;
  const auto f = static_cast<std::uint32_t>(factor);
  return by_parts<IntPack<W, P>>([f](auto& r, auto& x) { r.v = decltype(r.v)(Unsigned(x.v) * f); },
                                 a);
}
/// Sum of eight numbers in a fixed order.
template <int P>
float sum(const FloatPack<8, P>& a) {
  const auto s = a.template half<0>().v + a.template half<1>().v;
  return (s[0] + s[2]) + (s[1] + s[3]);
}
template <int W, int P>
float smallest(const FloatPack<W, P>& a) {
  float numbers[W];
  a.store(numbers);
  return *std::min_element(numbers, numbers + W);
}
template <int W, int P>
float largest(const FloatPack<W, P>& a) {
  float numbers[W];
  a.store(numbers);
  return *std::max_element(numbers, numbers + W);
}

/// Eight numbers in registers that every processor has.
using Float8 = FloatPack<8, 2>;

}  // namespace dynains::detail
