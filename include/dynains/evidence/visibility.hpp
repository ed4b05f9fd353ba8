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
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

/// Number of samples per block of add_visibility().
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
    const auto bytes = static_cast<std::ptrdiff_t>((count + 7) / 8);
    std::fill(free_.begin(), free_.begin() + bytes, std::uint8_t{0});
    std::fill(hit_.begin(), hit_.begin() + bytes, std::uint8_t{0});
  }
  /// Storage of the bits: one byte per eight samples.
  struct Bytes {
    std::uint8_t* free;  ///< all returns in the cells around the sample lie behind it
    std::uint8_t* hit;   ///< a static return lies at the sample
  };
  Bytes bytes() { return {free_.data(), hit_.data()}; }

  /// A sample that one view hits is no longer free: beams of the others pass beside it.
  void settle(std::size_t count) {
    for (std::size_t i = 0; i < (count + 7) / 8; ++i) {
      free_[i] = static_cast<std::uint8_t>(free_[i] & ~hit_[i]);
    }
  }

  /// Maximum number of samples of bits(): a word that begins with the byte of a bit contains at
  /// least as many bits from this bit on.
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
      add_bits(free_[i / 8], free + i);
      add_bits(hit_[i / 8], hit + i);
    }
  }

 private:
  // Adds eight bits to eight bytes, as one number: no sum exceeds its byte.
  static void add_bits(std::uint8_t bits, std::uint8_t* bytes) {
    std::uint64_t sum;
    std::memcpy(&sum, bytes, sizeof(sum));
    // Each byte has one of the bits, then 1 if it is set.
    const std::uint64_t spread = bits * 0x0101010101010101U & 0x8040201008040201U;
    sum += (spread + 0x7F7F7F7F7F7F7F7FU) >> 7U & 0x0101010101010101U;
    std::memcpy(bytes, &sum, sizeof(sum));
  }
  static std::uint64_t word_from(const std::vector<std::uint8_t>& bits, std::size_t first) {
    std::uint64_t word;
    std::memcpy(&word, &bits[first / 8], sizeof(word));
    return word >> first % 8;
  }
  std::vector<std::uint8_t> free_, hit_;
};

/// Tests of samples against one range image. A return lies behind a sample if its range is larger
/// by more than `margin` (m) + `slope` (m/m) * range of the sample.
template <class Packs>
class ImageTest {
 public:
  using Float = typename Packs::Float;
  using Int = typename Packs::Int;

  /// `to_image`: from the frame of the samples to the frame of the image. `viewpoint`: see
  /// add_visibility().
  ImageTest(const RangeImage& image, const PackTransform& to_image, float margin, float slope,
            const Eigen::Vector3f& viewpoint)
      : to_image_(to_image),
        viewpoint_{viewpoint.x(), viewpoint.y(), viewpoint.z()},
        locator_(image.grid()),
        margin_(margin * RangeImage::kCentimetres),
        slope_(slope * RangeImage::kCentimetres),
        cell_width_(1.0F / image.grid().columns_per_radian),
        cell_height_(1.0F / image.grid().rows_per_level),
        cells_(image.data()),
        beams_(image.beams()) {}

  /// Finds the cells of a pack of samples (m) and their ranges, and prefetches the cells: an image
  /// is larger than the inner caches.
  void locate(const Float& x, const Float& y, const Float& z, std::int32_t* cell,
              float* range) const {
    project(x, y, z, [&](const auto&, const auto&, const Float& distance, const auto& at) {
      at.cell.store(cell);
      distance.store(range);
    });
    for (std::size_t k = 0; k < kPackWidth; ++k) {
      __builtin_prefetch(&cells_[static_cast<std::uint32_t>(cell[k])]);
    }
  }

  /// Bits of a pack of samples.
  struct Compared {
    unsigned before;  ///< all returns in the cells around the sample lie behind it
    unsigned at;      ///< a static return lies at the sample
  };
  /// Compares the ranges of a pack of samples with their cells. A sample at a return of a moving
  /// point is neither before it nor at it.
  Compared compare(const std::int32_t* cell, const float* range) const {
    static_assert(RangeImage::kMoving == 1);
    static constexpr PackConstant kScale(RangeImage::kCentimetres);
    std::int32_t packed[kPackWidth];
    for (std::size_t k = 0; k < kPackWidth; ++k) {
      std::memcpy(&packed[k], &cells_[cell[k]], sizeof(std::int32_t));
    }
    const Int cells = Int::load(packed);
    const Float metres = Float::load(range);
    const Float tolerance = metres * Float(slope_) + Float(margin_);
    const Float centimetres = metres * Float(kScale);
    // Cell::nearest is the lower half of a cell, Cell::around the upper half.
    const Float nearest = to_float((cells << 16) >> 16) - centimetres;
    const Float around = to_float(cells >> 16) - centimetres;
    const auto is_odd = [](const Int& value) { return (value << 31) < Int(0); };
    const auto is_nearest = abs(nearest) <= tolerance;
    const auto is_moving_beside = is_odd(cells);
    const auto is_inside = Int(0) < Int::load(cell);
    const auto before = is_inside & (around > tolerance) & ~(is_nearest & is_moving_beside);
    const auto at = is_inside & ((is_nearest & ~is_moving_beside) |
                                 ((abs(around) <= tolerance) & ~is_odd(cells >> 16)));
    return {before.bits(), at.bits()};
  }

  /// Bits of the samples (m) that a beam passes near enough, of those in `cell`. The largest
  /// lateral distance is the error of poses and points, and the width of a beam at its range, at
  /// most that of the pack in `reach_of` (m) unless this is null. A beam that passes between a
  /// sample and the viewpoint, farther from the sample than a part of this distance, is no
  /// evidence: the beam that measured the sample crossed that space as well.
  unsigned is_near(const Float& x, const Float& y, const Float& z, const std::int32_t* cell,
                   const float* reach_of) const {
    static constexpr PackConstant kReach(0.05F), kReachSlope(0.004F);  // m, m/m
    static constexpr PackConstant kBefore(0.25F), kOne(1.0F);
    static constexpr PackConstant kStep(1.0F / RangeImage::kPlaces),
        kHalf(0.5F / RangeImage::kPlaces);
    std::int32_t packed[kPackWidth];
    for (std::size_t k = 0; k < kPackWidth; ++k) packed[k] = beams_[cell[k]];
    const Int beam = Int::load(packed);
    const auto within = [](const Int& step) {
      return to_float(step) * Float(kStep) + Float(kHalf);
    };
    unsigned near = 0;
    project(x, y, z, [&](const auto& p, const Float& level, const Float& distance, const auto& at) {
      const Float horizontal = sqrt(level);
      const Float aside = (within(beam >> 8) - at.column) * (horizontal * Float(cell_width_));
      const Float above =
          (within(beam & Int(RangeImage::kPlaces - 1)) - at.row) * (distance * Float(cell_height_));
      Float reach = distance * Float(kReachSlope) + Float(kReach);
      if (reach_of != nullptr) reach = min(reach, Float::load(reach_of));
      // Direction from the samples to the viewpoint, along the columns and the rows.
      const Float vx(viewpoint_[0]), vy(viewpoint_[1]), vz(viewpoint_[2]);
      const Float dx = p[0] - vx;
      const Float dy = p[1] - vy;
      const Float dz = p[2] - vz;
      const Float unit = Float(kOne) / (horizontal * distance * sqrt(dx * dx + dy * dy + dz * dz));
      const Float back_aside = (vy * p[0] - vx * p[1]) * distance * unit;
      const Float back_above = (vz * level - p[2] * (vx * p[0] + vy * p[1])) * unit;
      near = ((aside * aside + above * above <= reach * reach) &
              (aside * back_aside + above * back_above <= reach * Float(kBefore)))
                 .bits();
    });
    return near;
  }

 private:
  // Calls `use(point in the frame of the image, squared horizontal distance, distance, place in the
  // image)`, m and m^2. Packs that are returned in a structure would go through memory.
  template <class Use>
  void project(const Float& px, const Float& py, const Float& pz, const Use& use) const {
    const Float p[] = {to_image_(0, px, py, pz), to_image_(1, px, py, pz),
                       to_image_(2, px, py, pz)};
    const Float level = p[0] * p[0] + p[1] * p[1];
    const Float distance = sqrt(level + p[2] * p[2]);
    use(p, level, distance, locator_.template locate<Packs>(p[0], p[1], p[2], distance));
  }

  PackTransform to_image_;
  PackConstant viewpoint_[3];  // m, frame of the image
  ImageLocator locator_;
  PackConstant margin_, slope_;            // cm, cm/m
  PackConstant cell_width_, cell_height_;  // rad
  const RangeImage::Cell* cells_;
  const RangeImage::Beam* beams_;
};

/// Adds what a range image shows of the first `count` samples (m; padded for packs) to bits that
/// were cleared. A sample may become both "free" in one image and "hit" in another: call
/// Visibility::settle() after the last one. `T_image_sample`: rigid. `margin`, `slope`: see
/// ImageTest. `viewpoint`: the place that the samples were measured from, frame of the image, m; if
/// there are several, its origin. `reach`: by sample, as InstanceSamples::reach, or null.
inline void add_visibility(const RangeImage& image, const Pose& T_image_sample,
                           const PointBuffer& samples, std::size_t count, float margin, float slope,
                           Visibility& visibility,
                           const Eigen::Vector3f& viewpoint = Eigen::Vector3f::Zero(),
                           const float* reach = nullptr) {
  const PackTransform to_image(T_image_sample);
  with_packs([&](auto packs) {
    using Packs = decltype(packs);
    using Float = typename Packs::Float;
    const ImageTest<Packs> test(image, to_image, margin, slope, viewpoint);
    const float* const x = samples.x.data();
    const float* const y = samples.y.data();
    const float* const z = samples.z.data();
    const Visibility::Bytes bits = visibility.bytes();
    std::int32_t cell[kBeamBlock];
    float range[kBeamBlock];
    struct Passed {  // a pack of samples that beams may pass
      std::uint32_t begin;
      typename ImageTest<Packs>::Compared compared;
    } passed[kBeamBlock / kPackWidth];
    for (std::size_t block = 0; block < count; block += kBeamBlock) {
      const std::size_t end = std::min(block + kBeamBlock, count);
      for (std::size_t i = block; i < end; i += kPackWidth) {
        test.locate(Float::load(x + i), Float::load(y + i), Float::load(z + i), &cell[i - block],
                    &range[i - block]);
      }
      std::size_t passed_count = 0;
      for (std::size_t i = block; i < end; i += kPackWidth) {
        const auto compared = test.compare(&cell[i - block], &range[i - block]);
        if (compared.before == 0) {
          bits.hit[i / 8] = static_cast<std::uint8_t>(bits.hit[i / 8] | compared.at);
        } else {
          passed[passed_count++] = {static_cast<std::uint32_t>(i), compared};
        }
      }
      for (std::size_t k = 0; k < passed_count; ++k) {
        const auto& [i, compared] = passed[k];
        const unsigned free =
            compared.before & test.is_near(Float::load(x + i), Float::load(y + i),
                                           Float::load(z + i), &cell[i - block],
                                           reach == nullptr ? nullptr : reach + i);
        bits.free[i / 8] = static_cast<std::uint8_t>(bits.free[i / 8] | free);
        bits.hit[i / 8] = static_cast<std::uint8_t>(bits.hit[i / 8] | (compared.at & ~free));
      }
    }
  });
}

/// The visibility of samples from one image, see add_visibility().
inline void test_visibility(const RangeImage& image, const Pose& T_reference_sample,
                            const PointBuffer& samples, std::size_t count, float margin,
                            float slope, Visibility& visibility,
                            const Eigen::Vector3f& viewpoint = Eigen::Vector3f::Zero()) {
  visibility.clear(count);
  add_visibility(image, T_reference_sample, samples, count, margin, slope, visibility, viewpoint);
}

}  // namespace dynains::detail
