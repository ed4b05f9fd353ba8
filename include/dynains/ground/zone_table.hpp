// Constants that depend on the zone that a value lies in.
#pragma once

#include <array>
#include <cstddef>

#include "dynains/simd/lanes.hpp"
#include "dynains/simd/wide_lanes.hpp"

namespace dynains::detail {

inline constexpr std::size_t kZoneCount = 4;

/// Packs that are beyond the inner edges of the second, third and fourth zone. What is beyond one
/// edge is beyond those before.
template <class Mask>
using BeyondEdges = std::array<Mask, kZoneCount - 1>;

/// One constant for each zone, from the inside out.
class ZoneTable {
 public:
  explicit ZoneTable(const std::array<float, kZoneCount>& values)
      : first_(values[0]), steps_{values[0], values[0], values[0]}, places_(values[0]) {
    for (std::size_t i = 1; i < kZoneCount; ++i) {
      steps_[i - 1] = PackConstant(values[i - 1]).bits_changed(PackConstant(values[i]));
      for (const std::size_t lanes : {kPackWidth, kMaxPackWidth})
        places_.values[lanes - i] = values[i];
    }
  }

  /// That of the first zone, with the differences to later ones flipped bit by bit.
  Float8 at(const BeyondEdges<Mask8>& beyond) const {
    return float_of(bits_of(Float8(first_)) ^ (beyond[0] & bits_of(Float8(steps_[0]))) ^
                    (beyond[1] & bits_of(Float8(steps_[1]))) ^
                    (beyond[2] & bits_of(Float8(steps_[2]))));
  }
  /// A mask counts as -1, so that later zones have their places from the end of the table on.
  template <int kCount>
  WideFloat<kCount> at(const BeyondEdges<WideMask<kCount>>& beyond) const {
    return permuted(WideFloat<kCount>(places_),
                    WideInt<kCount>(beyond[0].v + beyond[1].v + beyond[2].v));
  }

 private:
  PackConstant first_;
  std::array<PackConstant, kZoneCount - 1> steps_;
  PackConstant places_;
};

}  // namespace dynains::detail
