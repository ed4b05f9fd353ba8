// Constants that depend on the zone that a value lies in.
#pragma once

#include <array>
#include <cstddef>

#include "dynains/detail/lanes.hpp"
#include "dynains/detail/wide_lanes.hpp"

namespace dynains::detail {

inline constexpr std::size_t kZoneCount = 4;

/// Lanes that are beyond the inner edges of the second, third and fourth zone. What is beyond one
/// edge is beyond those before.
template <class Mask>
using BeyondEdges = std::array<Mask, kZoneCount - 1>;

/// One constant for each zone, from the inside out.
class ZoneTable {
 public:
  explicit ZoneTable(const std::array<float, kZoneCount>& values)
      : first_(values[0]), steps_{values[0], values[0], values[0]}, places_(values[0]) {
    for (std::size_t i = 1; i < kZoneCount; ++i) {
      steps_[i - 1] = Constant8(values[i - 1]).bits_changed(Constant8(values[i]));
      places_.values[kLanes - i] = values[i];
    }
  }

  /// That of the first zone, with the differences to later ones flipped bit by bit.
  Float8 at(const BeyondEdges<Mask8>& beyond) const {
    return float_of(bits_of(Float8(first_)) ^ (beyond[0] & bits_of(Float8(steps_[0]))) ^
                    (beyond[1] & bits_of(Float8(steps_[1]))) ^
                    (beyond[2] & bits_of(Float8(steps_[2]))));
  }
  /// A mask counts as -1, so that later zones have their places from the end of the table on.
  WideFloat8 at(const BeyondEdges<WideMask8>& beyond) const {
    return permuted(WideFloat8(places_), WideInt8(beyond[0].v + beyond[1].v + beyond[2].v));
  }

 private:
  Constant8 first_;
  std::array<Constant8, kZoneCount - 1> steps_;
  Constant8 places_;
};

}  // namespace dynains::detail
