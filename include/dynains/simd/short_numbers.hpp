// A list of numbers of 32 bits in about half of its memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

/// Holds the lower 16 bits of each number, and the upper 16 bits of each run of numbers that share
/// them: two bytes per number, and eight per run.
class ShortNumbers {
 public:
  std::size_t size() const { return lower_.size(); }

  /// Ensures capacity for `count` numbers with few runs.
  void reserve(std::size_t count) {
    ensure_capacity(lower_, count);
    ensure_capacity(runs_, count / 16);
  }

  void assign(Span<const std::uint32_t> numbers) {
    reserve(numbers.size());
    lower_.resize(numbers.size());
    runs_.clear();
    with_packs([&](auto packs) {
      using Packs = decltype(packs);
      take<Packs>(numbers);
    });
  }

  /// Replaces the content of `numbers` by the list.
  void copy_to(std::vector<std::uint32_t>& numbers) const {
    resize_with_margin(numbers, size());
    std::uint32_t* const to = numbers.data();
    const std::uint16_t* const lower = lower_.data();
    with_packs([&](auto) {
      for (std::size_t run = 0; run < runs_.size(); ++run) {
        const std::uint32_t upper = runs_[run].upper;
        const std::size_t end = run + 1 < runs_.size() ? runs_[run + 1].begin : size();
        for (std::size_t i = runs_[run].begin; i < end; ++i) to[i] = upper | lower[i];
      }
    });
  }

 private:
  struct Run {
    std::uint32_t begin;
    std::uint32_t upper;  // the lower bits are zero
  };

  template <class Packs>
  void take(Span<const std::uint32_t> numbers) {
    const std::size_t count = numbers.size();
    const std::uint32_t* const from = numbers.data();
    std::uint16_t* const lower = lower_.data();
    for (std::size_t i = 0; i < count; ++i) lower[i] = static_cast<std::uint16_t>(from[i]);
    for_each_run<Packs, 16>(
        count,
        [&](std::size_t begin, std::size_t) {
          runs_.push_back({static_cast<std::uint32_t>(begin), from[begin] >> 16 << 16});
        },
        from);
  }

  std::vector<std::uint16_t> lower_;
  std::vector<Run> runs_;
};

}  // namespace dynains::detail
