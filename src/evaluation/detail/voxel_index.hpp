// Numbers the voxels of a point set.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::evaluation::detail {

/// Numbers voxels from 0 in the order of insertion. A hash table finds blocks of 4 x 4 x 4 voxels,
/// an array the voxel within its block: neighbouring voxels mostly share a block and its memory.
class VoxelIndex {
 public:
  /// Number of a voxel that is not in the index.
  static constexpr std::uint32_t kNone = VoxelHashTable<>::kNone;

  std::size_t size() const { return size_; }

  /// Number of a voxel, or kNone.
  std::uint32_t find(VoxelKey key) const { return number_in(block_of(key), key); }

  /// Number of a voxel; adds a new voxel with the number size().
  std::uint32_t insert(VoxelKey key) { return insert_into(add_block_of(key), key); }

  /// find() for `count` voxels at once waits less for memory.
  void find(const VoxelKey* keys, std::size_t count, std::uint32_t* numbers) const {
    prefetch_blocks(keys, count);
    for (std::size_t k = 0; k < count; ++k) {
      numbers[k] = is_in_block_before(keys, k) ? numbers[k - 1] : block_of(keys[k]);
      if (numbers[k] != kNone) prefetch_number(numbers[k], keys[k]);
    }
    for (std::size_t k = 0; k < count; ++k) numbers[k] = number_in(numbers[k], keys[k]);
  }

  /// insert() for `count` voxels in order.
  void insert(const VoxelKey* keys, std::size_t count, std::uint32_t* numbers) {
    prefetch_blocks(keys, count);
    for (std::size_t k = 0; k < count; ++k) {
      numbers[k] = is_in_block_before(keys, k) ? numbers[k - 1] : add_block_of(keys[k]);
      prefetch_number(numbers[k], keys[k]);
    }
    for (std::size_t k = 0; k < count; ++k) numbers[k] = insert_into(numbers[k], keys[k]);
  }

  /// Fetches what a later find() or insert() needs first.
  void prefetch(VoxelKey key) const {
    __builtin_prefetch(&blocks_.first_slot(voxel_hash(key & kBlockBits)));
  }

 private:
  static constexpr VoxelKey kPlaceBits =
      VoxelKey{3} << (2 * kVoxelKeyBits) | VoxelKey{3} << kVoxelKeyBits | VoxelKey{3};
  static constexpr VoxelKey kBlockBits = ~kPlaceBits;
  using Numbers = std::array<std::uint32_t, 64>;

  static std::size_t place(VoxelKey key) {
    return (key >> (2 * kVoxelKeyBits) & 3U) << 4U | (key >> kVoxelKeyBits & 3U) << 2U | (key & 3U);
  }

  std::uint32_t block_of(VoxelKey key) const { return blocks_.find(key & kBlockBits); }
  std::uint32_t add_block_of(VoxelKey key) {
    const std::uint32_t block = blocks_.insert(key & kBlockBits);
    if (block == numbers_.size()) numbers_.emplace_back().fill(kNone);
    return block;
  }

  std::uint32_t number_in(std::uint32_t block, VoxelKey key) const {
    return block == kNone ? kNone : numbers_[block][place(key)];
  }
  std::uint32_t insert_into(std::uint32_t block, VoxelKey key) {
    std::uint32_t& number = numbers_[block][place(key)];
    if (number == kNone) number = static_cast<std::uint32_t>(size_++);
    return number;
  }

  static bool is_in_block_before(const VoxelKey* keys, std::size_t k) {
    return k > 0 && ((keys[k] ^ keys[k - 1]) & kBlockBits) == 0;
  }
  void prefetch_blocks(const VoxelKey* keys, std::size_t count) const {
    for (std::size_t k = 0; k < count; ++k) prefetch(keys[k]);
  }
  void prefetch_number(std::uint32_t block, VoxelKey key) const {
    __builtin_prefetch(&numbers_[block][place(key)]);
  }

  std::size_t size_ = 0;
  VoxelHashTable<> blocks_;
  std::vector<Numbers> numbers_;  // by block
};

}  // namespace dynains::evaluation::detail
