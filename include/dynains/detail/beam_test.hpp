// The inner loop of free-space evidence: samples of one scan against the range image of another.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "dynains/detail/lanes.hpp"
#include "dynains/points.hpp"
#include "dynains/range_image.hpp"

namespace dynains::detail {

/// What one reference says of one sample; bits, so that counting is adding.
struct Sight {
  static constexpr std::uint32_t kUnknown = 0;
  static constexpr std::uint32_t kFree = 1;  ///< all beams about it went farther
  static constexpr std::uint32_t kHit = 2;   ///< a beam ended there
};

/// Beams that are tested together.
inline constexpr std::size_t kBeamBlock = 128;

/// Tests `count` samples against a reference and writes a Sight each. `samples`: m, padded for wide
/// loads; `T_reference_sample`: rigid. `margin` + `slope` * range: m, how much farther a beam must
/// go to pass. `sights` is resized, padded.
inline void test_beams(const RangeImageGrid& grid, const RangeImage& image,
                       const Eigen::Isometry3f& T_reference_sample, const PointBuffer& samples,
                       std::size_t count, float margin, float slope,
                       std::vector<std::uint32_t>& sights) {
  constexpr float kCentimetres = 100.0F;
  const auto& m = T_reference_sample.matrix();
  const Float8 m00(m(0, 0)), m01(m(0, 1)), m02(m(0, 2)), m03(m(0, 3));
  const Float8 m10(m(1, 0)), m11(m(1, 1)), m12(m(1, 2)), m13(m(1, 3));
  const Float8 m20(m(2, 0)), m21(m(2, 1)), m22(m(2, 2)), m23(m(2, 3));
  const Float8 to_centimetres(kCentimetres);
  const Float8 base(margin * kCentimetres);
  const Float8 growth(slope * kCentimetres);
  const Int8 free_bit(Sight::kFree);
  const Int8 hit_bit(Sight::kHit);
  const Int8 none(0);
  const std::size_t padded = (count + kBeamBlock - 1) / kBeamBlock * kBeamBlock;
  if (sights.size() < padded) sights.resize(padded);
  const RangeImage::Cell* const cells = image.data();
  // Images are larger than the caches near the core: all cells of a block are asked for before the
  // first is needed.
  std::int32_t cell[kBeamBlock];
  float ranges[kBeamBlock];
  std::int32_t packed[kLanes];
  for (std::size_t begin = 0; begin < count; begin += kBeamBlock) {
    const std::size_t size = std::min(kBeamBlock, count - begin);
    for (std::size_t i = 0; i < size; i += kLanes) {
      const Float8 px = Float8::load(&samples.x[begin + i]);
      const Float8 py = Float8::load(&samples.y[begin + i]);
      const Float8 pz = Float8::load(&samples.z[begin + i]);
      const ImageLocation at = locate(grid, (m00 * px + m01 * py) + (m02 * pz + m03),
                                      (m10 * px + m11 * py) + (m12 * pz + m13),
                                      (m20 * px + m21 * py) + (m22 * pz + m23));
      at.cell.store(&cell[i]);
      at.range.store(&ranges[i]);
      for (std::size_t lane = i; lane < i + kLanes; ++lane) __builtin_prefetch(&cells[cell[lane]]);
    }
    for (std::size_t i = 0; i < size; i += kLanes) {
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        std::memcpy(&packed[lane], &cells[cell[i + lane]], sizeof(std::int32_t));
      }
      const Int8 both = Int8::load(packed);
      // `nearest` is the lower half of a cell, `around` the upper.
      const Float8 nearest = to_float(Int8((both.lo << 16) >> 16, (both.hi << 16) >> 16));
      const Float8 around = to_float(Int8(both.lo >> 16, both.hi >> 16));
      const Float8 metres = Float8::load(&ranges[i]);
      const Float8 range = metres * to_centimetres;
      const Float8 tolerance = metres * growth + base;
      const Mask8 inside = Int8::load(&cell[i]) > none;
      const Mask8 free = inside & (around - range > tolerance);
      const Mask8 hit = inside & ~free &
                        ((abs(nearest - range) <= tolerance) | (abs(around - range) <= tolerance));
      const Int8 sight = select(free, free_bit, select(hit, hit_bit, none));
      std::memcpy(&sights[begin + i], &sight, sizeof(sight));
    }
  }
}

}  // namespace dynains::detail
