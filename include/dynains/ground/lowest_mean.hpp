// Mean of the lowest values of a sequence.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

/// Collects the lowest values of a sequence and adds them in ascending order. It avoids branches on
/// single values, which are unpredictable.
template <std::size_t kMaxWanted, class Packs>
class LowestMean {
 public:
  explicit LowestMean(std::size_t wanted) : wanted_(wanted) {}

  /// Mean of the `wanted` lowest finite values that are at least `floor`: of all if there are
  /// fewer, and `floor` if there are none. Eight infinite values must follow the last one.
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
      if (found_ > kCapacity - kPackWidth)
        bound = Float(std::nextafter(drop_highest(), -kInfinity));
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
  static constexpr std::size_t kCapacity = 2 * kMaxWanted;

  // An upper bound of the wanted values that admits few others. It deals the values out to as many
  // interleaved lists as are wanted, at least, and returns the wanted-th of the lists' minima. The
  // lists are interleaved since neighbouring values are similar.
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
    // The smallest of the minima that are at least as large as `wanted` of them.
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
    return smallest(result);
  }

  // Keeps only the wanted values; returns the highest of them.
  float drop_highest() {
    std::nth_element(found_values_.begin(), found_values_.begin() + wanted_ - 1,
                     found_values_.begin() + found_);
    found_ = wanted_;
    return found_values_[wanted_ - 1];
  }

  float mean() const {
    std::array<std::size_t, kCapacity> rank;
    for (std::size_t i = 0; i < found_; ++i) {
      rank[i] = 0;
      for (std::size_t k = 0; k < i; ++k) {
        const std::size_t lower = found_values_[i] < found_values_[k] ? 1 : 0;
        rank[k] += lower;
        rank[i] += 1 - lower;
      }
    }
    std::array<float, kCapacity> sorted;
    for (std::size_t i = 0; i < found_; ++i) sorted[rank[i]] = found_values_[i];
    const std::size_t count = std::min(found_, wanted_);
    float total = 0.0F;
    for (std::size_t i = 0; i < count; ++i) total += sorted[i];
    return total / static_cast<float>(count);
  }

  std::size_t wanted_;
  std::size_t found_ = 0;
  std::array<float, kCapacity> found_values_{};
};

}  // namespace dynains::detail
