// The inner loop of free-space evidence: samples of one scan against the range image of another.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "dynains/evidence/range_image.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/bits.hpp"
#include "dynains/simd/capacity.hpp"
#include "dynains/simd/lanes.hpp"
#include "dynains/simd/pack_transform.hpp"
#include "dynains/simd/wide_lanes.hpp"

namespace dynains::detail {

/// Beams that are tested together.
inline constexpr std::size_t kBeamBlock = 256;

/// What one reference says of many samples, a bit each.
class Visibility {
 public:
  /// Room for `count` samples; their bits are to be written.
  void resize(std::size_t count) {
    // Counting reads eight bytes from that of the first bit on.
    const std::size_t bytes = (count + kBeamBlock - 1) / kBeamBlock * kBeamBlock / 8 + 8;
    grow(free_, bytes);
    grow(hit_, bytes);
  }
  /// To be written: a byte for eight samples.
  struct Bytes {
    std::uint8_t* free;  ///< all beams about the sample went farther
    std::uint8_t* hit;   ///< a beam ended there, at something that stays
  };
  Bytes bytes() { return {free_.data(), hit_.data()}; }

  struct Count {
    std::uint32_t free;
    std::uint32_t hit;
  };
  Count count(std::size_t begin, std::size_t end) const {
    constexpr std::size_t kAtOnce = 56;  // what a word has at least, from any bit of its first byte
    constexpr std::uint64_t kAll = (std::uint64_t{1} << kAtOnce) - 1;
    Count seen = {0, 0};
    for (; end - begin > kAtOnce; begin += kAtOnce) {
      seen.free += count_ones(word_from(free_, begin) & kAll);
      seen.hit += count_ones(word_from(hit_, begin) & kAll);
    }
    const std::uint64_t left = (std::uint64_t{1} << (end - begin)) - 1;
    seen.free += count_ones(word_from(free_, begin) & left);
    seen.hit += count_ones(word_from(hit_, begin) & left);
    return seen;
  }
  /// Counts up, for each of the first `count` samples, how many references saw it free or hit it:
  /// fewer than 256. Both have room for a multiple of eight.
  void add_to(std::size_t count, std::uint8_t* free, std::uint8_t* hit) const {
    for (std::size_t i = 0; i < count; i += 8) {
      for (std::size_t k = 0; k < 8; ++k) {
        free[i + k] = static_cast<std::uint8_t>(free[i + k] + kBytesOfBits[free_[i / 8]][k]);
        hit[i + k] = static_cast<std::uint8_t>(hit[i + k] + kBytesOfBits[hit_[i / 8]][k]);
      }
    }
  }

  /// Of the 64 samples from `first` on, a multiple of 64; of those behind the last it may say
  /// anything.
  std::uint64_t free_word(std::size_t first) const { return word_at(free_, first); }
  std::uint64_t hit_word(std::size_t first) const { return word_at(hit_, first); }
  bool is_free(std::size_t sample) const { return (free_[sample / 8] >> sample % 8 & 1U) != 0; }
  bool is_hit(std::size_t sample) const { return (hit_[sample / 8] >> sample % 8 & 1U) != 0; }

 private:
  // From the byte on that holds the first bit.
  static std::uint64_t word_at(const std::vector<std::uint8_t>& bits, std::size_t first) {
    std::uint64_t word;
    std::memcpy(&word, &bits[first / 8], sizeof(word));
    return word;
  }
  static std::uint64_t word_from(const std::vector<std::uint8_t>& bits, std::size_t first) {
    return word_at(bits, first) >> first % 8;
  }
  std::vector<std::uint8_t> free_, hit_;
};

/// Tests `count` samples against a reference. `samples`: m, padded for wide loads;
/// `T_reference_sample`: rigid. `margin` + `slope` * range: m, how much farther a beam must go to
/// pass. What moved and was met again says nothing of its place.
inline void test_visibility(const RangeImage& image, const Eigen::Isometry3f& T_reference_sample,
                            const PointBuffer& samples, std::size_t count, float margin,
                            float slope, Visibility& visibility) {
  constexpr float kCentimetres = 100.0F;
  const PackTransform to_reference(T_reference_sample.matrix().topRows<3>());
  const PackConstant to_centimetres(kCentimetres);
  const PackConstant base(margin * kCentimetres), growth(slope * kCentimetres);
  const ImageLocator locator(image.grid());
  visibility.resize(count);
  run_packs([&](auto packs) {
    using Packs = decltype(packs);
    using Float = typename Packs::Float;
    using Int = typename Packs::Int;
    // Read once: stores of bytes may change anything, as far as the compiler knows.
    const Visibility::Bytes seen = visibility.bytes();
    const RangeImage::Cell* const cells = image.data();
    const Float scale(to_centimetres), least(base), slope_per_metre(growth);
    // Images are larger than the caches near the core: all cells of a block are asked for before
    // the first is needed.
    std::int32_t cell[kBeamBlock];
    float ranges[kBeamBlock];
    std::int32_t packed[kPackWidth];
    for (std::size_t begin = 0; begin < count; begin += kBeamBlock) {
      const std::size_t size = std::min(kBeamBlock, count - begin);
      for (std::size_t i = 0; i < size; i += kPackWidth) {
        const Float px = Float::load(&samples.x[begin + i]);
        const Float py = Float::load(&samples.y[begin + i]);
        const Float pz = Float::load(&samples.z[begin + i]);
        const Float x = to_reference(0, px, py, pz);
        const Float y = to_reference(1, px, py, pz);
        const Float z = to_reference(2, px, py, pz);
        const Float range = sqrt((x * x + y * y) + z * z);
        locator.template locate<Packs>(x, y, z, range).store(&cell[i]);
        range.store(&ranges[i]);
        for (std::size_t k = i; k < i + kPackWidth; ++k) __builtin_prefetch(&cells[cell[k]]);
      }
      for (std::size_t i = 0; i < size; i += kPackWidth) {
        for (std::size_t k = 0; k < kPackWidth; ++k) {
          std::memcpy(&packed[k], &cells[cell[i + k]], sizeof(std::int32_t));
        }
        const Int both = Int::load(packed);
        // `nearest` is the lower half of a cell, `around` the upper.
        const Float nearest = to_float((both << 16) >> 16);
        const Float around = to_float(both >> 16);
        const Float metres = Float::load(&ranges[i]);
        const Float range = metres * scale;
        const Float tolerance = metres * slope_per_metre + least;
        const auto inside = Int(0) < Int::load(&cell[i]);
        const auto is_at = [&](const Float& value) { return abs(value - range) <= tolerance; };
        const auto is_odd = [](const Int& value) { return (value << 31) < Int(0); };
        const auto is_nearest = is_at(nearest);
        static_assert(RangeImage::kMoving == 1);
        const auto is_moving_beside = is_odd(both);
        const auto is_moving = is_odd(both >> 16);
        const auto free = inside & (around - range > tolerance) & ~(is_nearest & is_moving_beside);
        const auto hit =
            inside & ~free & ((is_nearest & ~is_moving_beside) | (is_at(around) & ~is_moving));
        seen.free[(begin + i) / 8] = static_cast<std::uint8_t>(free.bits());
        seen.hit[(begin + i) / 8] = static_cast<std::uint8_t>(hit.bits());
      }
    }
  });
}

}  // namespace dynains::detail
