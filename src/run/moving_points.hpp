// The moving points of a scan.
#pragma once

#include <cstddef>
#include <cstring>

#include "dynains/points.hpp"
#include "dynains/verdict.hpp"

namespace dynains::program {

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

}  // namespace dynains::program
