// Number of points by final label.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "dynains/points.hpp"
#include "dynains/verdict.hpp"

namespace dynains::program {

struct LabelCounts {
  std::array<std::uint64_t, 5> of{};  ///< by PointLabel

  void add(Span<const PointLabel> labels) {
    for (const PointLabel label : labels) ++of[static_cast<std::size_t>(label)];
  }
  LabelCounts& operator+=(const LabelCounts& other) {
    for (std::size_t i = 0; i < of.size(); ++i) of[i] += other.of[i];
    return *this;
  }
  bool operator==(const LabelCounts& other) const { return of == other.of; }
  std::uint64_t operator[](PointLabel label) const { return of[static_cast<std::size_t>(label)]; }
};

}  // namespace dynains::program
