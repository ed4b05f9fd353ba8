// The lanes of lanes.hpp in one register each, for processors that have AVX2, chosen at run time.
//
// A kernel is a generic function object that takes the kind of lanes and works with its types. It
// is instantiated twice and gives the same bits both times. No vector passes the border of
// run_wide_lanes, because the two sides of it would pass one differently.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "dynains/detail/lanes.hpp"
#include "dynains/detail/shuffle.hpp"

namespace dynains::detail {

using WideInts = std::int32_t __attribute__((vector_size(32)));
using WideFloats = float __attribute__((vector_size(32)));

// What vectors have no operator for. By reference: no vector passes the border to code that is
// compiled for other registers. Clang does not inline a function for AVX2 into a lambda that is
// not, and does better by halves.
#if defined(__x86_64__) && defined(__SSE2__) && !defined(__clang__)
[[gnu::target("avx2")]] inline unsigned sign_bits(const WideInts& of) {
  return static_cast<unsigned>(__builtin_ia32_movmskps256(WideFloats(of)));
}
[[gnu::target("avx2")]] inline void take_root(WideFloats& of) { of = __builtin_ia32_sqrtps256(of); }
// Elsewhere, GCC puts equal numbers together one by one.
template <class Number, class Vector>
[[gnu::target("avx2")]] void spread(Number n, Vector& to) {
  to = Vector{} + n;
}
#else
inline unsigned sign_bits(const WideInts& of) {
  Mask8 halves;
  shuffle<0, 1, 2, 3>(of, of, halves.lo);
  shuffle<4, 5, 6, 7>(of, of, halves.hi);
  return halves.bits();
}
inline void take_root(WideFloats& of) {
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

struct WideMask8 {
  using Vector = WideInts;
  Vector v;

  friend WideMask8 operator&(const WideMask8& a, const WideMask8& b) { return {a.v & b.v}; }
  friend WideMask8 operator^(const WideMask8& a, const WideMask8& b) { return {a.v ^ b.v}; }
  friend WideMask8 operator|(const WideMask8& a, const WideMask8& b) { return {a.v | b.v}; }
  friend WideMask8 operator~(const WideMask8& a) { return {~a.v}; }

  /// Lane i as bit i.
  unsigned bits() const { return sign_bits(v); }
};

struct WideInt8 {
  using Vector = WideInts;
  Vector v;

  WideInt8() = default;
  explicit WideInt8(const Vector& vector) : v(vector) {}
  explicit WideInt8(std::int32_t n) { spread(n, v); }

  static WideInt8 load(const std::int32_t* from) {
    WideInt8 result;
    std::memcpy(&result.v, from, sizeof(Vector));
    return result;
  }
  void store(std::int32_t* to) const { std::memcpy(to, &v, sizeof(Vector)); }

  friend WideInt8 operator+(const WideInt8& a, const WideInt8& b) { return WideInt8(a.v + b.v); }
  friend WideInt8 operator-(const WideInt8& a, const WideInt8& b) { return WideInt8(a.v - b.v); }
  friend WideInt8 operator<<(const WideInt8& a, int bits) { return WideInt8(a.v << bits); }
  friend WideInt8 operator>>(const WideInt8& a, int bits) { return WideInt8(a.v >> bits); }
  friend WideInt8 operator&(const WideInt8& a, const WideInt8& b) { return WideInt8(a.v & b.v); }
  friend WideInt8 operator^(const WideInt8& a, const WideInt8& b) { return WideInt8(a.v ^ b.v); }
  friend WideMask8 operator<(const WideInt8& a, const WideInt8& b) { return {a.v < b.v}; }
  friend WideMask8 operator==(const WideInt8& a, const WideInt8& b) { return {a.v == b.v}; }
};

struct WideFloat8 {
  using Vector = WideFloats;
  Vector v;

  WideFloat8() = default;
  explicit WideFloat8(const Vector& vector) : v(vector) {}
  WideFloat8(const Constant8& constant) { std::memcpy(&v, constant.values, sizeof(Vector)); }

  static WideFloat8 load(const float* from) {
    WideFloat8 result;
    std::memcpy(&result.v, from, sizeof(Vector));
    return result;
  }
  void store(float* to) const { std::memcpy(to, &v, sizeof(Vector)); }

  using F = WideFloat8;
  friend F operator+(const F& a, const F& b) { return F(a.v + b.v); }
  friend F operator-(const F& a, const F& b) { return F(a.v - b.v); }
  friend F operator*(const F& a, const F& b) { return F(a.v * b.v); }
  friend F operator/(const F& a, const F& b) { return F(a.v / b.v); }
  friend WideMask8 operator<(const F& a, const F& b) { return {a.v < b.v}; }
  friend WideMask8 operator<=(const F& a, const F& b) { return {a.v <= b.v}; }
  friend WideMask8 operator>(const F& a, const F& b) { return {a.v > b.v}; }
  friend WideMask8 operator>=(const F& a, const F& b) { return {a.v >= b.v}; }

  friend WideMask8 bits_of(const F& a) { return {WideMask8::Vector(a.v)}; }
  friend F select(const WideMask8& mask, const F& a, const F& b) { return F(mask.v ? a.v : b.v); }
  friend F keep(const WideMask8& mask, const F& a) { return float_of(mask & bits_of(a)); }
  friend F min(const F& a, const F& b) { return F(a.v < b.v ? a.v : b.v); }
  friend F max(const F& a, const F& b) { return F(a.v > b.v ? a.v : b.v); }
  friend F abs(const F& a) { return float_of(bits_of(a) & WideMask8{WideInt8(0x7FFFFFFF).v}); }
  friend F sqrt(const F& a) {
    F root = a;
    take_root(root.v);
    return root;
  }

  static F float_of(const WideMask8& a) { return F(Vector(a.v)); }
};

inline WideFloat8 float_of(const WideMask8& a) { return WideFloat8::float_of(a); }

inline WideInt8 select(const WideMask8& mask, const WideInt8& a, const WideInt8& b) {
  return WideInt8(mask.v ? a.v : b.v);
}
inline WideInt8 keep(const WideMask8& mask, const WideInt8& a) { return WideInt8(mask.v & a.v); }
inline WideInt8 truncate(const WideFloat8& a) {
  return WideInt8(__builtin_convertvector(a.v, WideInt8::Vector));
}
inline WideFloat8 to_float(const WideInt8& a) {
  return WideFloat8(__builtin_convertvector(a.v, WideFloat8::Vector));
}
inline WideInt8 multiply(const WideInt8& a, std::int32_t factor) {
  using Unsigned = std::uint32_t __attribute__((vector_size(32)));  // may overflow
  return WideInt8(WideInt8::Vector(Unsigned(a.v) * static_cast<std::uint32_t>(factor)));
}
inline WideInt8 floor(const WideFloat8& a) {
  const WideInt8 whole = truncate(a);
  return WideInt8(whole.v + (to_float(whole) > a).v);  // all bits set is -1
}
inline float sum(const WideFloat8& a) {
  Float8 halves;
  shuffle<0, 1, 2, 3>(a.v, a.v, halves.lo);
  shuffle<4, 5, 6, 7>(a.v, a.v, halves.hi);
  return sum(halves);
}

/// Lane i is lane `from[i]` of `a`, modulo eight.
inline WideFloat8 permuted(const WideFloat8& a, const WideInt8& from) {
#if defined(__clang__)
  return WideFloat8(__builtin_shufflevector(a.v, from.v));
#else
  return WideFloat8(__builtin_shuffle(a.v, from.v));
#endif
}

struct NarrowLanes {
  using Float = Float8;
  using Int = Int8;
  using Mask = Mask8;
};
struct WideLanes {
  using Float = WideFloat8;
  using Int = WideInt8;
  using Mask = WideMask8;
};

#if defined(__x86_64__) && defined(__SSE2__)
template <class Kernel>
[[gnu::target("avx2"), gnu::flatten]] void run_wide_lanes(Kernel& kernel) {
  kernel(WideLanes());
}
inline bool has_wide_lanes() { return __builtin_cpu_supports("avx2") != 0; }
#else
template <class Kernel>
void run_wide_lanes(Kernel& kernel) {
  kernel(WideLanes());
}
inline bool has_wide_lanes() { return false; }
#endif

/// Calls `kernel` with WideLanes where the processor has registers for them, else with NarrowLanes.
template <class Kernel>
void run_lanes(Kernel&& kernel) {
  if (has_wide_lanes()) return run_wide_lanes(kernel);
  kernel(NarrowLanes());
}

/// 0 to 7.
template <class Int>
Int lane_numbers() {
  alignas(32) static constexpr std::int32_t kNumbers[kLanes] = {0, 1, 2, 3, 4, 5, 6, 7};
  return Int::load(kNumbers);
}

/// True in the lanes below `count`.
template <class Lanes>
typename Lanes::Mask lanes_below(std::size_t count) {
  using Int = typename Lanes::Int;
  return lane_numbers<Int>() < Int(static_cast<std::int32_t>(count));
}

/// Eight neighbouring places of some arrays; fewer at their end, if `kTail`.
template <class Lanes, bool kTail>
struct Places : Lanes {
  std::size_t begin;
  std::size_t end;

  Places(std::size_t first, std::size_t last) : begin(first), end(last) {}

  std::size_t size() const { return kTail ? end - begin : kLanes; }
  /// Zeros behind the end.
  typename Lanes::Float load(const float* from) const {
    return load_as<typename Lanes::Float>(from);
  }
  typename Lanes::Int load(const std::uint32_t* from) const {
    return load_as<typename Lanes::Int>(reinterpret_cast<const std::int32_t*>(from));
  }
  /// `a` in the lanes that have a place, else `b`.
  typename Lanes::Float there(const typename Lanes::Float& a,
                              const typename Lanes::Float& b) const {
    if constexpr (!kTail) return a;
    return select(lanes_below<Lanes>(size()), a, b);
  }

 private:
  template <class Vector, class Value>
  Vector load_as(const Value* from) const {
    if constexpr (!kTail) return Vector::load(from + begin);
    alignas(32) Value values[kLanes] = {};
    for (std::size_t i = begin; i < end; ++i) values[i - begin] = from[i];
    return Vector::load(values);
  }
};

/// Calls `kernel(Places)` for all of `count` places, eight by eight and from the first on; within a
/// kernel that has its lanes already.
template <class Lanes, class Kernel>
void for_places(std::size_t count, Kernel&& kernel) {
  std::size_t begin = 0;
  for (; begin + kLanes <= count; begin += kLanes) {
    kernel(Places<Lanes, false>(begin, begin + kLanes));
  }
  if (begin < count) kernel(Places<Lanes, true>(begin, count));
}

/// Neighbouring places of arrays that can be read beyond their ends.
template <class Lanes, bool kTail>
struct PaddedPlaces : Places<Lanes, kTail> {
  using Places<Lanes, kTail>::Places;
  /// Whatever is there behind the end.
  typename Lanes::Float load(const float* from) const {
    return Lanes::Float::load(from + this->begin);
  }
};

/// Calls `kernel(PaddedPlaces)` for the places from `begin` to `end`, for some of them twice: what
/// does not fill eight lanes begins earlier if it can.
template <class Lanes, class Kernel>
void for_places_again(std::size_t begin, std::size_t end, Kernel&& kernel) {
  if (end - begin < kLanes) return kernel(PaddedPlaces<Lanes, true>(begin, end));
  for (; begin + kLanes < end; begin += kLanes) {
    kernel(PaddedPlaces<Lanes, false>(begin, begin + kLanes));
  }
  kernel(PaddedPlaces<Lanes, false>(end - kLanes, end));
}

/// As for_places, with the lanes that suit the processor.
template <class Kernel>
void for_lanes(std::size_t count, Kernel&& kernel) {
  run_lanes([&](auto lanes) { for_places<decltype(lanes)>(count, kernel); });
}

}  // namespace dynains::detail
