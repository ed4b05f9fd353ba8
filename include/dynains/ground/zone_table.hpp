// Constants that depend on the zone that a value lies in.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "dynains/simd/pack_loops.hpp"

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
      steps_[i - 1] = changed_bits(values[i - 1], values[i]);
      for (const std::size_t lanes : {kPackWidth, kMaxPackWidth})
        places_.values[lanes - i] = values[i];
    }
  }

  /// A mask counts as -1, so that later zones have their places from the end of the table on. The
  /// narrow kind flips the bits that differ between zones instead.
  template <int kWidth, int kParts>
  FloatPack<kWidth, kParts> at(const BeyondEdges<IntPack<kWidth, kParts>>& beyond) const {
    using Float = FloatPack<kWidth, kParts>;
    if constexpr (kParts == 1) {
      return permuted(Float(places_), beyond[0] + beyond[1] + beyond[2]);
    } else {
      return float_of(bits_of(Float(first_)) ^ (beyond[0] & bits_of(Float(steps_[0]))) ^
                      (beyond[1] & bits_of(Float(steps_[1]))) ^
                      (beyond[2] & bits_of(Float(steps_[2]))));
    }
  }

 private:
  static float changed_bits(float from, float to) {
    std::uint32_t a, b;
    std::memcpy(&a, &from, sizeof(a));
    std::memcpy(&b, &to, sizeof(b));
    a ^= b;
    float bits;
    std::memcpy(&bits, &a, sizeof(bits));
    return bits;
  }

  PackConstant first_;
  std::array<PackConstant, kZoneCount - 1> steps_;
  PackConstant places_;
};

}  // namespace dynains::detail
