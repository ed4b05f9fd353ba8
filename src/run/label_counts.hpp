// Number of points by final label.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "dynains/points.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/verdict.hpp"

namespace dynains::program {

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

}  // namespace dynains::program
