// Keys of the voxels of a regular grid, and their hashes.
#pragma once

#include <cstdint>

namespace dynains {

/// Index of a voxel in its grid as one number, ordered by x, then y, then z. Each of the three
/// indices lies in [-2^20, 2^20).
using VoxelKey = std::uint64_t;

inline constexpr int kVoxelKeyBits = 21;  // of each index
inline constexpr std::int64_t kVoxelKeyOffset = std::int64_t{1} << (kVoxelKeyBits - 1);

constexpr VoxelKey voxel_key(std::int64_t x, std::int64_t y, std::int64_t z) {
  return static_cast<VoxelKey>(x + kVoxelKeyOffset) << (2 * kVoxelKeyBits) |
         static_cast<VoxelKey>(y + kVoxelKeyOffset) << kVoxelKeyBits |
         static_cast<VoxelKey>(z + kVoxelKeyOffset);
}

/// Difference between the keys of two voxels that lie so many steps apart.
constexpr VoxelKey voxel_key_step(std::int64_t dx, std::int64_t dy, std::int64_t dz) {
  return (static_cast<VoxelKey>(dx) << (2 * kVoxelKeyBits)) +
         (static_cast<VoxelKey>(dy) << kVoxelKeyBits) + static_cast<VoxelKey>(dz);
}

/// Index of a voxel along axis 0 (x), 1 (y) or 2 (z).
constexpr std::int64_t voxel_index(VoxelKey key, int axis) {
  constexpr VoxelKey kMask = (VoxelKey{1} << kVoxelKeyBits) - 1;
  return static_cast<std::int64_t>(key >> ((2 - axis) * kVoxelKeyBits) & kMask) - kVoxelKeyOffset;
}

/// Hash of a key; its upper bits are mixed best.
constexpr std::uint32_t voxel_hash(VoxelKey key) {
  constexpr std::uint64_t kMix = 0x9E3779B97F4A7C15ULL;  // 2^64 over the golden ratio
  return static_cast<std::uint32_t>(((key ^ key >> 32U) * kMix) >> 32U);
}

namespace detail {

constexpr std::int32_t multiply(std::int32_t a, std::int32_t b) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) * static_cast<std::uint32_t>(b));
}

/// Hash of three numbers, for one triple or for a pack of them; its upper bits are mixed best.
template <class Int>
Int mixed_hash(const Int& a, const Int& b, const Int& c) {
  const auto factor = [](std::uint32_t odd) { return static_cast<std::int32_t>(odd); };
  const Int all = multiply(a, factor(0x9E3779B1U)) ^ multiply(b, factor(0x85EBCA77U)) ^
                  multiply(c, factor(0xC2B2AE3DU));
  return multiply(all ^ (all >> 15), factor(0x2C1B3C6DU));
}

}  // namespace detail
}  // namespace dynains
