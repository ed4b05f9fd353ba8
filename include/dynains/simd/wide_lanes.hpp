// The lanes of lanes.hpp in one register each, for processors that have AVX2, and sixteen of them
// where there is AVX-512; chosen at run time.
//
// A kernel is a generic function object that takes the kind of lanes and works with its types. It
// is instantiated for each kind and gives the same bits every time. No vector passes the border of
// run_wide_lanes, because the two sides of it would pass one differently.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "dynains/simd/bits.hpp"
#include "dynains/simd/lanes.hpp"
#include "dynains/simd/shuffle.hpp"
#include "dynains/simd/vector_operations.hpp"

namespace dynains::detail {

template <int kCount>
struct WideMask {
  using Vector = typename Vectors<kCount>::Ints;
  Vector v;

  using M = WideMask;
  friend M operator&(const M& a, const M& b) { return {a.v & b.v}; }
  friend M operator^(const M& a, const M& b) { return {a.v ^ b.v}; }
  friend M operator|(const M& a, const M& b) { return {a.v | b.v}; }
  friend M operator~(const M& a) { return {~a.v}; }

  /// Lane i as bit i.
  unsigned bits() const { return sign_bits(v); }
};

template <int kCount>
struct WideInt {
  using Vector = typename Vectors<kCount>::Ints;
  Vector v;

  WideInt() = default;
  explicit WideInt(const Vector& vector) : v(vector) {}
  explicit WideInt(std::int32_t n) { spread(n, v); }

  static WideInt load(const std::int32_t* from) {
    WideInt result;
    load_vector(from, result.v);
    return result;
  }
  void store(std::int32_t* to) const { store_vector(v, to); }

  using I = WideInt;
  using M = WideMask<kCount>;
  friend I operator+(const I& a, const I& b) { return I(a.v + b.v); }
  friend I operator-(const I& a, const I& b) { return I(a.v - b.v); }
  friend I operator<<(const I& a, int bits) { return I(a.v << bits); }
  friend I operator>>(const I& a, int bits) { return I(a.v >> bits); }
  friend I operator&(const I& a, const I& b) { return I(a.v & b.v); }
  friend I operator^(const I& a, const I& b) { return I(a.v ^ b.v); }
  friend M operator<(const I& a, const I& b) {
    M result;
    compare_less(a.v, b.v, result.v);
    return result;
  }
  friend M operator==(const I& a, const I& b) {
    M result;
    compare_equal(a.v, b.v, result.v);
    return result;
  }

  friend I select(const M& mask, const I& a, const I& b) {
    I result;
    choose(mask.v, a.v, b.v, result.v);
    return result;
  }
  friend I keep(const M& mask, const I& a) { return I(mask.v & a.v); }
  friend I multiply(const I& a, std::int32_t factor) {
    using Unsigned = typename Vectors<kCount>::Unsigned;  // may overflow
    return I(Vector(Unsigned(a.v) * static_cast<std::uint32_t>(factor)));
  }
};

template <int kCount>
struct WideFloat {
  using Vector = typename Vectors<kCount>::Floats;
  Vector v;

  WideFloat() = default;
  explicit WideFloat(const Vector& vector) : v(vector) {}
  explicit WideFloat(float value) { spread(value, v); }
  WideFloat(const PackConstant& constant) { load_vector(constant.values, v); }

  static WideFloat load(const float* from) {
    WideFloat result;
    load_vector(from, result.v);
    return result;
  }
  void store(float* to) const { store_vector(v, to); }

  using F = WideFloat;
  using I = WideInt<kCount>;
  using M = WideMask<kCount>;
  friend F operator+(const F& a, const F& b) { return F(a.v + b.v); }
  friend F operator-(const F& a, const F& b) { return F(a.v - b.v); }
  friend F operator*(const F& a, const F& b) {
    F product = a;
    multiply_by(b.v, product.v);
    return product;
  }
  friend F operator/(const F& a, const F& b) { return F(a.v / b.v); }
  friend M operator<(const F& a, const F& b) {
    M result;
    compare_less(a.v, b.v, result.v);
    return result;
  }
  friend M operator<=(const F& a, const F& b) {
    M result;
    compare_at_most(a.v, b.v, result.v);
    return result;
  }
  friend M operator>(const F& a, const F& b) { return b < a; }
  friend M operator>=(const F& a, const F& b) { return b <= a; }

  friend M bits_of(const F& a) { return {typename M::Vector(a.v)}; }
  static F float_of(const M& a) { return F(Vector(a.v)); }
  friend F select(const M& mask, const F& a, const F& b) {
    F result;
    choose(mask.v, a.v, b.v, result.v);
    return result;
  }
  friend F keep(const M& mask, const F& a) { return float_of(mask & bits_of(a)); }
  friend F min(const F& a, const F& b) {
    F result;
    take_lesser(a.v, b.v, result.v);
    return result;
  }
  friend F max(const F& a, const F& b) {
    F result;
    take_greater(a.v, b.v, result.v);
    return result;
  }
  friend F abs(const F& a) { return float_of(bits_of(a) & M{I(0x7FFFFFFF).v}); }
  friend F sqrt(const F& a) {
    F root = a;
    take_root(root.v);
    return root;
  }
  friend I truncate(const F& a) { return I(__builtin_convertvector(a.v, typename I::Vector)); }
  friend I floor(const F& a) {
    const I whole = truncate(a);
    return I(whole.v + (a < F(__builtin_convertvector(whole.v, Vector))).v);  // all bits set is -1
  }
  /// Lane i is lane `from[i]` of `a`, modulo their number.
  friend F permuted(const F& a, const I& from) {
#if defined(__clang__)
    return F(__builtin_shufflevector(a.v, from.v));
#else
    return F(__builtin_shuffle(a.v, from.v));
#endif
  }
};

/// Of the same bits.
template <int kCount>
WideFloat<kCount> float_of(const WideMask<kCount>& a) {
  return WideFloat<kCount>::float_of(a);
}

template <int kCount>
WideFloat<kCount> to_float(const WideInt<kCount>& a) {
  using Floats = typename Vectors<kCount>::Floats;
  return WideFloat<kCount>(__builtin_convertvector(a.v, Floats));
}

using WideMask8 = WideMask<8>;
using WideInt8 = WideInt<8>;
using WideFloat8 = WideFloat<8>;

inline float sum(const WideFloat8& a) {
  Float8 halves;
  shuffle<0, 1, 2, 3>(a.v, a.v, halves.lo);
  shuffle<4, 5, 6, 7>(a.v, a.v, halves.hi);
  return sum(halves);
}

/// The kinds of lanes: types, and how many there are.
struct NarrowPacks {
  using Float = Float8;
  using Int = Int8;
  using Mask = Mask8;
  static constexpr std::size_t kCount = kPackWidth;
  static constexpr unsigned kAll = (1U << kCount) - 1U;  ///< a bit for each
};
template <int kLaneCount>
struct RegisterLanes {
  using Float = WideFloat<kLaneCount>;
  using Int = WideInt<kLaneCount>;
  using Mask = WideMask<kLaneCount>;
  static constexpr std::size_t kCount = kLaneCount;
  static constexpr unsigned kAll = (1U << kCount) - 1U;
};
using WidePacks = RegisterLanes<8>;
using WidestPacks = RegisterLanes<16>;

#if defined(__x86_64__) && defined(__SSE2__)
template <class Kernel>
[[gnu::target("avx2"), gnu::flatten]] void run_wide_lanes(Kernel& kernel) {
  kernel(WidePacks());
}
template <class Kernel>
[[gnu::target("avx512f,avx512bw,avx512dq,avx512vl"), gnu::flatten]] void run_widest_lanes(
    Kernel& kernel) {
  kernel(WidestPacks());
}
inline bool has_wide_lanes() { return __builtin_cpu_supports("avx2") != 0; }
/// Not where they slow the processor down, as they did when they were new: VBMI2 came later.
inline bool has_widest_lanes() {
  return kHasSixteen && __builtin_cpu_supports("avx512vbmi2") != 0 &&
         __builtin_cpu_supports("avx512bw") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
         __builtin_cpu_supports("avx512vl") != 0;
}
#else
template <class Kernel>
void run_wide_lanes(Kernel& kernel) {
  kernel(WidePacks());
}
template <class Kernel>
void run_widest_lanes(Kernel& kernel) {
  kernel(WidestPacks());
}
inline bool has_wide_lanes() { return false; }
inline bool has_widest_lanes() { return false; }
#endif

/// Calls `kernel`, which needs eight lanes, with WidePacks where the processor has registers for
/// them, else with NarrowPacks.
template <class Kernel>
void run_packs(Kernel&& kernel) {
  if (has_wide_lanes()) return run_wide_lanes(kernel);
  kernel(NarrowPacks());
}

/// Calls `kernel` with as many lanes as the processor has registers for.
template <class Kernel>
void run_max_packs(Kernel&& kernel) {
  if constexpr (kHasSixteen) {
    if (has_widest_lanes()) return run_widest_lanes(kernel);
  }
  run_packs(kernel);
}

#if defined(__clang__)
// Clang takes into run_wide_lanes what is called there, and more only if told to.
template <class Packs, class Kernel>
[[gnu::always_inline, gnu::flatten]] void for_slices(std::size_t count, Kernel&& kernel);
template <class Packs, class Kernel>
[[gnu::always_inline, gnu::flatten]] void for_overlapping_slices(std::size_t begin, std::size_t end,
                                                                 Kernel&& kernel);
#endif

/// 0 to 7, or to 15.
template <class Int>
Int lane_indices() {
  alignas(64) static constexpr std::int32_t kNumbers[] = {0, 1, 2,  3,  4,  5,  6,  7,
                                                          8, 9, 10, 11, 12, 13, 14, 15};
  return Int::load(kNumbers);
}

/// Writes `first` plus the number of each lane whose bit is set, and whatever is behind these, as
/// many as there are lanes. Returns how many bits are set.
template <class Packs>
std::size_t put_places(unsigned bits, std::size_t first, std::uint32_t* to) {
  if constexpr (std::is_same_v<Packs, WidestPacks>) {
    using Int = typename Packs::Int;
    Int places = lane_indices<Int>() + Int(static_cast<std::int32_t>(first));
    compress(bits, places.v);
    places.store(reinterpret_cast<std::int32_t*>(to));
    return count_ones(bits);
  } else {
    for (std::size_t k = 0; k < Packs::kCount; ++k) {
      to[k] = static_cast<std::uint32_t>(first + kPlacesOfBits[bits][k]);
    }
    return kOnesUpTo[bits].back();
  }
}

/// Which of up to 64 places, a bit each, differ from the one before them in any of some arrays of
/// 32 bits a value; that before the first is read, too.
template <class Packs, class... Values>
std::uint64_t find_changes(std::size_t count, const Values*... values) {
  using Int = typename Packs::Int;
  std::uint64_t changes = 0;
  std::size_t i = 0;
  for (; i + Packs::kCount <= count; i += Packs::kCount) {
    const auto load = [i](const auto* from) {
      return Int::load(reinterpret_cast<const std::int32_t*>(from + i));
    };
    const auto same = ((load(values) == load(values - 1)) & ...);
    changes |= std::uint64_t{(~same).bits()} << i;
  }
  for (; i < count; ++i) {
    changes |= std::uint64_t{((*(values + i) != *(values + i - 1)) || ...)} << i;
  }
  return changes;
}

/// True in the lanes below `count`.
template <class Packs>
typename Packs::Mask mask_below(std::size_t count) {
  using Int = typename Packs::Int;
  return lane_indices<Int>() < Int(static_cast<std::int32_t>(count));
}

/// Neighbouring places of some arrays, as many as there are lanes; fewer at their end, if `kTail`.
template <class Packs, bool kTail>
struct Places : Packs {
  std::size_t begin;
  std::size_t end;

  Places(std::size_t first, std::size_t last) : begin(first), end(last) {}

  std::size_t size() const { return kTail ? end - begin : Packs::kCount; }
  /// Zeros behind the end.
  typename Packs::Float load(const float* from) const {
    return load_as<typename Packs::Float>(from);
  }
  typename Packs::Int load(const std::uint32_t* from) const {
    return load_as<typename Packs::Int>(reinterpret_cast<const std::int32_t*>(from));
  }
  /// `a` in the lanes that have a place, else `b`.
  typename Packs::Float there(const typename Packs::Float& a,
                              const typename Packs::Float& b) const {
    if constexpr (!kTail) return a;
    return select(mask_below<Packs>(size()), a, b);
  }

 private:
  template <class Vector, class Value>
  Vector load_as(const Value* from) const {
    if constexpr (!kTail) return Vector::load(from + begin);
    alignas(64) Value values[Packs::kCount] = {};
    for (std::size_t i = begin; i < end; ++i) values[i - begin] = from[i];
    return Vector::load(values);
  }
};

/// Calls `kernel(Places)` for all of `count` places, from the first on; within a kernel that has
/// its lanes already.
template <class Packs, class Kernel>
void for_slices(std::size_t count, Kernel&& kernel) {
  std::size_t begin = 0;
  for (; begin + Packs::kCount <= count; begin += Packs::kCount) {
    kernel(Places<Packs, false>(begin, begin + Packs::kCount));
  }
  if (begin < count) kernel(Places<Packs, true>(begin, count));
}

/// Neighbouring places of arrays that can be read beyond their ends.
template <class Packs, bool kTail>
struct PaddedPackSlice : Places<Packs, kTail> {
  using Places<Packs, kTail>::Places;
  /// Whatever is there behind the end.
  typename Packs::Float load(const float* from) const {
    return Packs::Float::load(from + this->begin);
  }
};

/// Calls `kernel(PaddedPackSlice)` for the places from `begin` to `end`, for some of them twice:
/// what does not fill all lanes begins earlier if it can.
template <class Packs, class Kernel>
void for_overlapping_slices(std::size_t begin, std::size_t end, Kernel&& kernel) {
  if (end - begin < Packs::kCount) return kernel(PaddedPackSlice<Packs, true>(begin, end));
  for (; begin + Packs::kCount < end; begin += Packs::kCount) {
    kernel(PaddedPackSlice<Packs, false>(begin, begin + Packs::kCount));
  }
  kernel(PaddedPackSlice<Packs, false>(end - Packs::kCount, end));
}

/// As for_slices, with the lanes that suit the processor.
template <class Kernel>
void for_packs(std::size_t count, Kernel&& kernel) {
  run_max_packs([&](auto packs) { for_slices<decltype(packs)>(count, kernel); });
}

}  // namespace dynains::detail
