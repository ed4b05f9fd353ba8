// Set of voxels that have a point.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// Set of voxels by their three indices. Blocks of 8 x 4 x 2 voxels are the keys of a hash table
/// with open addressing, at most half of whose slots are in use; each has a bit for each voxel.
/// Neighbouring points of a scan mostly lie in one block. Memory: 32 to 64 bytes for each block.
class FilledVoxels {
 public:
  using Index = std::array<std::int64_t, 3>;

  bool has(const Index& voxel) const { return (slot(block_key(voxel)).bits & bit_of(voxel)) != 0; }

  /// False if the set had the voxel already.
  bool add(const Index& voxel) {
    if (2 * size_ >= slots_.size()) grow();
    const VoxelKey key = block_key(voxel);
    Slot& own = slots_[slot_of(key)];
    if (own.bits == 0) {
      own.key = key;
      ++size_;
    }
    const bool is_new = (own.bits & bit_of(voxel)) == 0;
    own.bits |= bit_of(voxel);
    return is_new;
  }

  /// Fetches what a later call of has() needs.
  void prefetch(const Index& voxel) const {
    __builtin_prefetch(&slots_[first_of(block_key(voxel))]);
  }

 private:
  struct Slot {
    VoxelKey key = 0;
    std::uint64_t bits = 0;  // 0: the slot is empty
  };

  static VoxelKey block_key(const Index& voxel) {
    return voxel_key(voxel[0] >> 3, voxel[1] >> 2, voxel[2] >> 1);
  }
  static std::uint64_t bit_of(const Index& voxel) {
    const std::int64_t place = (voxel[0] & 7) | (voxel[1] & 3) << 3 | (voxel[2] & 1) << 5;
    return std::uint64_t{1} << static_cast<std::uint64_t>(place);
  }

  std::size_t first_of(VoxelKey key) const { return voxel_hash(key) >> shift_; }
  // The slot of a key, or the empty slot where it would be.
  std::size_t slot_of(VoxelKey key) const {
    std::size_t at = first_of(key);
    while (slots_[at].bits != 0 && slots_[at].key != key) at = (at + 1) & (slots_.size() - 1);
    return at;
  }
  const Slot& slot(VoxelKey key) const { return slots_[slot_of(key)]; }

  void grow() {
    std::vector<Slot> old(2 * slots_.size());
    old.swap(slots_);
    --shift_;
    for (const Slot& slot : old) {
      if (slot.bits != 0) slots_[slot_of(slot.key)] = slot;
    }
  }

  int shift_ = 26;  // 32 - log2 of the number of slots
  std::size_t size_ = 0;
  std::vector<Slot> slots_ = std::vector<Slot>(64);
};

}  // namespace dynains
