// Mean of the lowest of some heights.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "dynains/simd/lanes.hpp"
#include "dynains/simd/wide_lanes.hpp"

namespace dynains::detail {

/// The lowest values of a sequence, summed up in the order of size. Nothing here branches on single
/// values, because no branch could be foretold.
template <std::size_t kMaxWanted, class Packs>
class LowestMean {
 public:
  explicit LowestMean(std::size_t wanted) : wanted_(wanted) {}

  /// Mean of the lowest `wanted` of the values that are not below `floor`; all of them if there are
  /// fewer, and `floor` if there is none. Infinite values stay out; behind the last one, there are
  /// some to fill up eight lanes.
  float of(const float* values, std::size_t count, float floor) {
    const Float infinity(kInfinity);
    const Float least(floor);
    const auto load = [&](std::size_t i) {
      const Float value = Float::load(values + i);
      return select(value >= least, value, infinity);
    };
    Float bound(bound_of(load, count));
    for (std::size_t i = 0; i < count; i += kPackWidth) {
      const Float value = load(i);
      const unsigned bits = ((value <= bound) & (value < infinity)).bits();
      if (bits == 0) continue;
      if (found_ > kRoom - kPackWidth) bound = Float(std::nextafter(drop_highest(), -kInfinity));
      for (std::size_t k = 0; k < kPackWidth; ++k) {
        found_values_[found_] = values[i + k];
        found_ += (bits >> k) & 1U;
      }
    }
    return found_ == 0 ? floor : mean();
  }

 private:
  using Float = typename Packs::Float;
  using Int = typename Packs::Int;

  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  static constexpr std::size_t kRoom = 2 * kMaxWanted;

  // No more than a few values are within the bound, mostly: it is the last wanted one of the least
  // values of some interleaved groups. Values often come in the order of their size.
  template <class Load>
  float bound_of(const Load& load, std::size_t count) const {
    const std::size_t groups = (wanted_ - 1) / kPackWidth + 1;
    alignas(32) std::array<float, kMaxWanted> least;
    for (std::size_t group = 0; group < groups; ++group) {
      Float lowest(kInfinity);
      for (std::size_t i = group * kPackWidth; i < count; i += groups * kPackWidth) {
        lowest = min(load(i), lowest);
      }
      lowest.store(&least[group * kPackWidth]);
    }
    // The least one of those that are not below `wanted` of them.
    const Int one(1);
    const Int enough(static_cast<std::int32_t>(wanted_) - 1);
    Float result(kInfinity);
    for (std::size_t group = 0; group < groups; ++group) {
      const Float value = Float::load(&least[group * kPackWidth]);
      Int not_above(0);
      for (std::size_t k = 0; k < groups * kPackWidth; ++k) {
        not_above = not_above + keep(Float(least[k]) <= value, one);
      }
      result = min(select(enough < not_above, value, Float(kInfinity)), result);
    }
    return min_lane(result);
  }

  // Leaves the wanted ones, and returns the highest of them.
  float drop_highest() {
    std::nth_element(found_values_.begin(), found_values_.begin() + wanted_ - 1,
                     found_values_.begin() + found_);
    found_ = wanted_;
    return found_values_[wanted_ - 1];
  }

  float mean() const {
    std::array<std::size_t, kRoom> rank;
    for (std::size_t i = 0; i < found_; ++i) {
      rank[i] = 0;
      for (std::size_t k = 0; k < i; ++k) {
        const std::size_t lower = found_values_[i] < found_values_[k] ? 1 : 0;
        rank[k] += lower;
        rank[i] += 1 - lower;
      }
    }
    std::array<float, kRoom> sorted;
    for (std::size_t i = 0; i < found_; ++i) sorted[rank[i]] = found_values_[i];
    const std::size_t count = std::min(found_, wanted_);
    float total = 0.0F;
    for (std::size_t i = 0; i < count; ++i) total += sorted[i];
    return total / static_cast<float>(count);
  }

  std::size_t wanted_;
  std::size_t found_ = 0;
  std::array<float, kRoom> found_values_{};
};

}  // namespace dynains::detail
