// Visibility of samples from a reference scan: the inner loop of the free-space evidence.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "dynains/evidence/range_image.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/simd/bits.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

/// Number of samples per block of test_visibility().
inline constexpr std::size_t kBeamBlock = 256;

/// Visibility of samples from one reference scan: for each sample one bit "free" and one bit "hit".
/// Not both are set; a sample without either is unknown.
class Visibility {
 public:
  /// Allocates the bits of `count` samples; the caller writes them.
  void resize(std::size_t count) {
    // count() reads eight bytes from the byte of the first bit on.
    const std::size_t bytes = (count + kBeamBlock - 1) / kBeamBlock * kBeamBlock / 8 + 8;
    grow(free_, bytes);
    grow(hit_, bytes);
  }
  /// Sets the bits of `count` samples to "unknown".
  void clear(std::size_t count) {
    resize(count);
    std::fill(free_.begin(), free_.end(), std::uint8_t{0});
    std::fill(hit_.begin(), hit_.end(), std::uint8_t{0});
  }
  /// Storage of the bits: one byte per eight samples.
  struct Bytes {
    std::uint8_t* free;  ///< all returns in the cells around the sample lie behind it
    std::uint8_t* hit;   ///< a static return lies at the sample
  };
  Bytes bytes() { return {free_.data(), hit_.data()}; }

  /// Adds what another view of the same reference sees of the first `count` samples. A sample may
  /// become both "free" and "hit": call settle() after the last view.
  void add(const Visibility& view, std::size_t count) {
    for (std::size_t i = 0; i < (count + 7) / 8; ++i) {
      free_[i] = static_cast<std::uint8_t>(free_[i] | view.free_[i]);
      hit_[i] = static_cast<std::uint8_t>(hit_[i] | view.hit_[i]);
    }
  }
  /// A sample that one view hits is no longer free: beams of the others pass beside it.
  void settle(std::size_t count) {
    for (std::size_t i = 0; i < (count + 7) / 8; ++i) {
      free_[i] = static_cast<std::uint8_t>(free_[i] & ~hit_[i]);
    }
  }

  /// Most samples of bits(): a word that begins with the byte of a bit contains at least as many
  /// bits from this bit on.
  static constexpr std::size_t kMaxBits = 56;
  struct Count {
    std::uint32_t free = 0;
    std::uint32_t hit = 0;
  };
  struct Bits {
    std::uint64_t free;
    std::uint64_t hit;

    Count count() const { return {count_ones(free), count_ones(hit)}; }
  };
  /// Bits of the samples in [begin, end), at most kMaxBits; the lowest one is that of sample
  /// `begin`.
  Bits bits(std::size_t begin, std::size_t end) const {
    const std::uint64_t all = (std::uint64_t{1} << (end - begin)) - 1;
    return {word_from(free_, begin) & all, word_from(hit_, begin) & all};
  }
  /// Numbers of free and hit samples in [begin, end).
  Count count(std::size_t begin, std::size_t end) const {
    Count sum;
    for (; begin < end; begin += kMaxBits) {
      const Count some = bits(begin, std::min(begin + kMaxBits, end)).count();
      sum.free += some.free;
      sum.hit += some.hit;
    }
    return sum;
  }
  /// For each of the first `count` samples, increments its number of "free" references in `free`
  /// and its number of "hit" references in `hit`; the results must be below 256. The sizes of both
  /// arrays are at least `count`, rounded up to a multiple of eight.
  void add_to(std::size_t count, std::uint8_t* free, std::uint8_t* hit) const {
    for (std::size_t i = 0; i < count; i += 8) {
      for (std::size_t k = 0; k < 8; ++k) {
        free[i + k] = static_cast<std::uint8_t>(free[i + k] + kBytesOfBits[free_[i / 8]][k]);
        hit[i + k] = static_cast<std::uint8_t>(hit[i + k] + kBytesOfBits[hit_[i / 8]][k]);
      }
    }
  }

 private:
  static std::uint64_t word_from(const std::vector<std::uint8_t>& bits, std::size_t first) {
    std::uint64_t word;
    std::memcpy(&word, &bits[first / 8], sizeof(word));
    return word >> first % 8;
  }
  std::vector<std::uint8_t> free_, hit_;
};

/// Largest lateral distance (m) from a sample to a beam that passes it: the error of poses and
/// points, and the width of a beam at its range.
struct BeamReach {
  static constexpr float kMin = 0.05F;     ///< m
  static constexpr float kSlope = 0.004F;  ///< m per m of range
};

/// Computes the bits of a pack of samples. `cells`: their cells of the range image, one
/// RangeImage::Cell per number. `is_inside`: whether they lie in the image. `is_near`: whether a
/// beam passes near enough. `range`, `tolerance`: range of the samples and margin, cm.
template <class Packs>
void compare_ranges(const typename Packs::Int& cells, const typename Packs::Mask& is_inside,
                    const typename Packs::Mask& is_near, const typename Packs::Float& range,
                    const typename Packs::Float& tolerance, std::uint8_t& free_bits,
                    std::uint8_t& hit_bits) {
  using Float = typename Packs::Float;
  using Int = typename Packs::Int;
  // Cell::nearest is the lower half of a cell, Cell::around the upper half.
  const Float nearest = to_float((cells << 16) >> 16);
  const Float around = to_float(cells >> 16);
  const auto is_at = [&](const Float& value) { return abs(value - range) <= tolerance; };
  const auto is_odd = [](const Int& value) { return (value << 31) < Int(0); };
  static_assert(RangeImage::kMoving == 1);
  const auto is_nearest = is_at(nearest);
  const auto is_moving_beside = is_odd(cells);
  const auto is_moving = is_odd(cells >> 16);
  const auto free =
      is_inside & is_near & (around - range > tolerance) & ~(is_nearest & is_moving_beside);
  const auto hit =
      is_inside & ~free & ((is_nearest & ~is_moving_beside) | (is_at(around) & ~is_moving));
  free_bits = static_cast<std::uint8_t>(free.bits());
  hit_bits = static_cast<std::uint8_t>(hit.bits());
}

/// Tests the first `count` samples (m; padded for packs) against a range image. A return lies
/// behind a sample if its range is larger by more than `margin` (m) + `slope` (m/m) * range of the
/// sample. A sample at a return of a moving point is neither "free" nor "hit".
/// `T_reference_sample`: rigid, from the frame of the samples to the frame of the image.
inline void test_visibility(const RangeImage& image, const Pose& T_reference_sample,
                            const PointBuffer& samples, std::size_t count, float margin,
                            float slope, Visibility& visibility) {
  const PackTransform to_reference(T_reference_sample);
  const PackConstant to_centimetres(RangeImage::kCentimetres);
  const PackConstant base(margin * RangeImage::kCentimetres),
      growth(slope * RangeImage::kCentimetres);
  // Angles of a cell, rad.
  const PackConstant width(1.0F / image.grid().columns_per_radian),
      height(1.0F / image.grid().rows_per_level);
  const ImageLocator locator(image.grid());
  visibility.resize(count);
  with_packs([&](auto packs) {
    using Packs = decltype(packs);
    using Float = typename Packs::Float;
    using Int = typename Packs::Int;
    // Local copies, since stores of bytes may alias the members.
    const Visibility::Bytes bits = visibility.bytes();
    const RangeImage::Cell* const cells = image.data();
    const RangeImage::Beam* const beams = image.beams();
    const Float scale(to_centimetres), least(base), slope_per_metre(growth);
    const Float cell_width(width), cell_height(height);
    static constexpr PackConstant kMin(BeamReach::kMin), kSlope(BeamReach::kSlope),
        kStep(1.0F / RangeImage::kPlaces), kHalf(0.5F / RangeImage::kPlaces);
    // All cells of a block are prefetched before the first is used, since an image is larger than
    // the inner caches.
    std::int32_t cell[kBeamBlock];
    float ranges[kBeamBlock], across[kBeamBlock], rows[kBeamBlock], columns[kBeamBlock];
    std::int32_t packed[kPackWidth], beam[kPackWidth];
    for (std::size_t begin = 0; begin < count; begin += kBeamBlock) {
      const std::size_t size = std::min(kBeamBlock, count - begin);
      for (std::size_t i = 0; i < size; i += kPackWidth) {
        const Float px = Float::load(&samples.x[begin + i]);
        const Float py = Float::load(&samples.y[begin + i]);
        const Float pz = Float::load(&samples.z[begin + i]);
        const Float x = to_reference(0, px, py, pz);
        const Float y = to_reference(1, px, py, pz);
        const Float z = to_reference(2, px, py, pz);
        const Float level = x * x + y * y;
        const Float range = sqrt(level + z * z);
        const auto located = locator.template locate<Packs>(x, y, z, range);
        located.cell.store(&cell[i]);
        range.store(&ranges[i]);
        (sqrt(level) * cell_width).store(&across[i]);
        located.row.store(&rows[i]);
        located.column.store(&columns[i]);
        for (std::size_t k = i; k < i + kPackWidth; ++k) {
          __builtin_prefetch(&cells[cell[k]]);
          __builtin_prefetch(&beams[cell[k]]);
        }
      }
      for (std::size_t i = 0; i < size; i += kPackWidth) {
        for (std::size_t k = 0; k < kPackWidth; ++k) {
          std::memcpy(&packed[k], &cells[cell[i + k]], sizeof(std::int32_t));
          beam[k] = beams[cell[i + k]];
        }
        const Int both = Int::load(packed);
        const Int place = Int::load(beam);
        const Float metres = Float::load(&ranges[i]);
        const auto within = [&](const Int& step) {
          return to_float(step) * Float(kStep) + Float(kHalf);
        };
        const Float aside =
            (within(place >> 8) - Float::load(&columns[i])) * Float::load(&across[i]);
        const Float above = (within(place & Int(RangeImage::kPlaces - 1)) - Float::load(&rows[i])) *
                            (metres * cell_height);
        const Float reach = metres * Float(kSlope) + Float(kMin);
        compare_ranges<Packs>(both, Int(0) < Int::load(&cell[i]),
                              aside * aside + above * above <= reach * reach, metres * scale,
                              metres * slope_per_metre + least, bits.free[(begin + i) / 8],
                              bits.hit[(begin + i) / 8]);
      }
    }
  });
}

}  // namespace dynains::detail
