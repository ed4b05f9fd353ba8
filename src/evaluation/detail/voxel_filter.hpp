// Rules out most voxels that are not in a set.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "evaluation/detail/located_points.hpp"
#include "evaluation/detail/voxel_grid.hpp"

namespace dynains::evaluation::detail {

/// Bits by the lower bits of the three indices of cubes of 4 x 4 x 4 voxels: small enough for the
/// fastest cache.
class VoxelFilter {
 public:
  void add(VoxelKey key) { words_[place(key) / 64] |= std::uint64_t{1} << place(key) % 64; }

  /// Takes the keys of points whose voxels were not added, except for a few. False if none is left.
  bool filter(PointBlock& block) const {
    VoxelKey all = kNoKey;
    for (std::size_t k = 0, count = block.count; k < count; ++k) {
      const VoxelKey key = block.key[k];
      const std::uint64_t is_added = words_[place(key) / 64] >> place(key) % 64 & 1U;
      block.key[k] = key | (is_added - 1);
      all &= block.key[k];
    }
    return all != kNoKey;
  }

 private:
  static std::size_t place(VoxelKey key) {
    return (key >> (2 * kVoxelKeyBits + 2) & 63U) << 10U |
           (key >> (kVoxelKeyBits + 2) & 63U) << 4U | (key >> 2U & 15U);
  }

  std::array<std::uint64_t, 1024> words_{};
};

}  // namespace dynains::evaluation::detail
