// Final labels of points: their numbers, and the moving ones.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <numeric>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/verdict.hpp"
#include "run/remarks/odd_scans.hpp"

namespace dynains::run {

/// Numbers of points in the final verdicts of a run.
struct Tally {
  std::uint64_t points = 0;
  std::array<std::uint64_t, 5> labels{};  ///< by PointLabel
  std::uint64_t unclustered = 0;   ///< static points that are neither ground nor in a cluster
  std::uint64_t below_movers = 0;  ///< removed points of the ground
  std::vector<ScanCounts> scans;

  std::uint64_t operator[](PointLabel label) const {
    return labels[static_cast<std::size_t>(label)];
  }

  void add(const ScanVerdict& verdict) {
    const std::uint64_t moving_before = (*this)[PointLabel::kDynamic];
    points += verdict.labels.size();
    detail::with_packs([&](auto) {
      for (std::size_t value = 0; value < labels.size(); ++value) {
        std::uint32_t count = 0;
        for (const PointLabel label : verdict.labels) {
          count += label == static_cast<PointLabel>(value);
        }
        labels[value] += count;
      }
    });
    scans.push_back({verdict.labels.size(), (*this)[PointLabel::kDynamic] - moving_before});
    unclustered += std::inner_product(
        verdict.labels.begin(), verdict.labels.end(), verdict.causes.begin(), std::uint32_t{0},
        std::plus<>(), [](PointLabel label, Cause cause) {
          return label == PointLabel::kStatic && cause == Cause::kNotJudged ? 1U : 0U;
        });
    below_movers += static_cast<std::uint64_t>(
        std::count(verdict.causes.begin(), verdict.causes.end(), Cause::kUnderInstance));
  }
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
