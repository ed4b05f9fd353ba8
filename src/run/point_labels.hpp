// Final labels of points: their numbers, and the moving ones.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "dynains/points.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/verdict.hpp"

namespace dynains::run {

struct LabelCounts {
  std::array<std::uint64_t, 5> of{};  ///< by PointLabel

  void add(Span<const PointLabel> labels) {
    detail::with_packs([&](auto) {
      for (std::size_t value = 0; value < of.size(); ++value) {
        std::uint32_t count = 0;
        for (const PointLabel label : labels) count += label == static_cast<PointLabel>(value);
        of[value] += count;
      }
    });
  }
  std::uint64_t operator[](PointLabel label) const { return of[static_cast<std::size_t>(label)]; }
};

/// Calls `visit(i)` for each point with the label kDynamic, in their order. They are few: the time
/// is that of a search for bytes.
template <class Visit>
void for_each_moving(Span<const PointLabel> labels, Visit&& visit) {
  static_assert(sizeof(PointLabel) == 1);
  const PointLabel* const first = labels.data();
  const PointLabel* const last = first + labels.size();
  for (const PointLabel* next = first; next != last; ++next) {
    next = static_cast<const PointLabel*>(std::memchr(next, static_cast<int>(PointLabel::kDynamic),
                                                      static_cast<std::size_t>(last - next)));
    if (next == nullptr) return;
    visit(static_cast<std::size_t>(next - first));
  }
}

}  // namespace dynains::run
