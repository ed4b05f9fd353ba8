// Packs of numbers in vector registers. Each operation is exactly rounded IEEE arithmetic: results
// are equal bit by bit for all widths, compilers and instruction sets, unless the compiler
// contracts multiplications and additions.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "dynains/simd/vector_register.hpp"

namespace dynains::detail {

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
    return by_parts<Pack>([](auto& r, auto& x, auto& y) { multiply(x, y, r); }, a, b);
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
    return by_parts<Mask>([](auto& r, auto& x, auto& y) { compare_less(x, y, r); }, a, b);
  }
  friend Mask operator<=(const Pack& a, const Pack& b) {
    return by_parts<Mask>([](auto& r, auto& x, auto& y) { compare_at_most(x, y, r); }, a, b);
  }
  friend Mask operator==(const Pack& a, const Pack& b) {
    return by_parts<Mask>([](auto& r, auto& x, auto& y) { compare_equal(x, y, r); }, a, b);
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
IntPack<W, P> keep(const IntPack<W, P>& mask, const IntPack<W, P>& a) {
  return mask & a;
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
