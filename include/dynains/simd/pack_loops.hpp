// Loops over arrays with the packs that suit the processor, chosen at run time.
//
// A kernel is a generic function object that takes a kind of packs, or a slice of arrays, and works
// with its types. It is compiled for each kind; results are equal bit by bit. Vectors must not be
// passed to or returned from with_avx2, whose callers pass vectors differently.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "dynains/simd/pack.hpp"

namespace dynains::detail {

/// Bits of a word. Loops take so many numbers at a time, with one bit for each.
inline constexpr std::size_t kWordBits = 64;

/// Number of set bits. Without -mpopcnt, the builtin function would call a library function.
constexpr std::uint32_t count_ones(std::uint64_t bits) {
  bits -= bits >> 1U & 0x5555555555555555U;
  bits = (bits & 0x3333333333333333U) + (bits >> 2U & 0x3333333333333333U);
  bits = (bits + (bits >> 4U)) & 0x0F0F0F0F0F0F0F0FU;
  return static_cast<std::uint32_t>(bits * 0x0101010101010101U >> 56U);
}

/// Calls `body(index)` for each set bit in ascending order.
template <class Body>
void for_each_bit(std::uint64_t bits, Body&& body) {
  for (; bits != 0; bits &= bits - 1) body(static_cast<std::size_t>(__builtin_ctzll(bits)));
}

/// A kind of packs: `kWidth` numbers of 32 bits, or twice as many of 16 bits, in `kParts`
/// registers.
template <int kWidth, int kParts>
struct PackKind {
  using Float = Pack<float, kWidth, kParts>;
  using Int = Pack<std::int32_t, kWidth, kParts>;
  using Mask = Int;
  using Short = Pack<std::int16_t, 2 * kWidth, kParts>;
  static constexpr std::size_t kCount = kWidth;
  static constexpr unsigned kAll = (1U << kCount) - 1U;  ///< a bit for each number
};
using BaselinePacks = PackKind<8, 2>;  ///< SSE2, NEON
using Avx2Packs = PackKind<8, 1>;

#if defined(__x86_64__) && defined(__SSE2__)
template <class Kernel>
[[gnu::target("avx2,bmi,bmi2,popcnt"), gnu::flatten]] void with_avx2(Kernel& kernel) {
  kernel(Avx2Packs());
}
inline bool has_avx2() {
  return __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("bmi2") != 0;
}
#else
template <class Kernel>
void with_avx2(Kernel& kernel) {
  kernel(Avx2Packs());
}
inline bool has_avx2() { return false; }
#endif

/// Calls `kernel` with packs of eight numbers: Avx2Packs or BaselinePacks.
template <class Kernel>
void with_packs(Kernel&& kernel) {
  if (has_avx2()) return with_avx2(kernel);
  kernel(BaselinePacks());
}

#if defined(__clang__)
// Without this attribute, Clang inlines only direct calls into with_avx2.
template <class Packs, class Kernel>
[[gnu::always_inline, gnu::flatten]] void for_slices(std::size_t begin, std::size_t end,
                                                     Kernel&& kernel);
#endif

/// Points per step of loops that pass over them twice: they fit the L1 cache.
inline constexpr std::size_t kStepPoints = 128;

/// The numbers 0, 1, 2, ...
template <class Int>
Int pack_indices() {
  alignas(32) static constexpr std::int32_t kIndices[kPackWidth] = {0, 1, 2, 3, 4, 5, 6, 7};
  return Int::load(kIndices);
}

/// Bit i is set if values[i] differs from values[i - 1] in any of the arrays, apart from the lower
/// `kIgnored` bits, i < `count` <= 64. values[-1] must exist.
template <class Packs, int kIgnored = 0, class... Values>
std::uint64_t find_changes(std::size_t count, const Values*... values) {
  using Int = typename Packs::Int;
  std::uint64_t changes = 0;
  std::size_t i = 0;
  for (; i + Packs::kCount <= count; i += Packs::kCount) {
    const auto load = [i](const auto* from) {
      return Int::load(reinterpret_cast<const std::int32_t*>(from + i));
    };
    const auto equal = ((((load(values) ^ load(values - 1)) >> kIgnored) == Int(0)) & ...);
    changes |= std::uint64_t{(~equal).bits()} << i;
  }
  for (; i < count; ++i) {
    changes |= std::uint64_t{(((values[i] ^ *(values + i - 1)) >> kIgnored != 0) || ...)} << i;
  }
  return changes;
}

/// Calls `visit(begin, end)` for each run of [0, count) in which the arrays do not change, apart
/// from the lower `kIgnored` bits.
template <class Packs, int kIgnored = 0, class Visitor, class... Values>
void for_each_run(std::size_t count, Visitor&& visit, const Values*... values) {
  std::size_t begin = 0;
  for (std::size_t i = 1; i < count; i += kWordBits) {
    const std::uint64_t changes =
        find_changes<Packs, kIgnored>(std::min(kWordBits, count - i), (values + i)...);
    for_each_bit(changes, [&](std::size_t at) {
      visit(begin, i + at);
      begin = i + at;
    });
  }
  if (begin < count) visit(begin, count);
}

/// The indices [begin, end) of arrays: as many as a pack has numbers, or fewer if `kTail`. Each
/// kernel call gets one slice.
template <class Packs, bool kTail>
struct PackSlice : Packs {
  std::size_t begin;
  std::size_t end;

  PackSlice(std::size_t first, std::size_t last) : begin(first), end(last) {}

  std::size_t size() const { return kTail ? end - begin : Packs::kCount; }
  /// The numbers of an array at these indices, then zeros.
  typename Packs::Float load(const float* from) const {
    return load_as<typename Packs::Float>(from);
  }
  typename Packs::Int load(const std::uint32_t* from) const {
    return load_as<typename Packs::Int>(reinterpret_cast<const std::int32_t*>(from));
  }
  /// The numbers of an array from `begin` on, also those behind `end`, which must exist.
  typename Packs::Float load_all(const float* from) const {
    return Packs::Float::load(from + begin);
  }
  /// The first size() numbers of `a`, then the numbers of `b`.
  typename Packs::Float padded(const typename Packs::Float& a,
                               const typename Packs::Float& b) const {
    if constexpr (!kTail) return a;
    const typename Packs::Int count(static_cast<std::int32_t>(size()));
    return select(pack_indices<typename Packs::Int>() < count, a, b);
  }

 private:
  template <class Result, class Value>
  Result load_as(const Value* from) const {
    if constexpr (!kTail) return Result::load(from + begin);
    alignas(32) Value values[Packs::kCount] = {};
    for (std::size_t i = begin; i < end; ++i) values[i - begin] = from[i];
    return Result::load(values);
  }
};

/// Calls `kernel(PackSlice)` for [begin, end) in order. For use within a kernel of with_packs.
template <class Packs, class Kernel>
void for_slices(std::size_t begin, std::size_t end, Kernel&& kernel) {
  for (; begin + Packs::kCount <= end; begin += Packs::kCount) {
    kernel(PackSlice<Packs, false>(begin, begin + Packs::kCount));
  }
  if (begin < end) kernel(PackSlice<Packs, true>(begin, end));
}

/// Calls `kernel(PackSlice)` for [0, count) in order, with the packs of with_packs().
template <class Kernel>
void for_packs(std::size_t count, Kernel&& kernel) {
  with_packs([&](auto packs) { for_slices<decltype(packs)>(0, count, kernel); });
}

}  // namespace dynains::detail
