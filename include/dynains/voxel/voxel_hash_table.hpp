// The hash table of the project: numbers voxels in the order in which they are inserted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "dynains/voxel/voxel_key.hpp"

namespace dynains {

/// Open addressing with linear probing; at most half of the slots are in use. Single keys cannot be
/// erased. `Key`: VoxelKey, or a type with operator== and a function voxel_hash(key).
template <class Key = VoxelKey>
class VoxelHashTable {
 public:
  /// Number of a key that is not in the table.
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  struct Slot {
    Key key = Key();
    std::uint32_t number = kNone;
  };

  /// Takes `expected` keys without growing.
  explicit VoxelHashTable(std::size_t expected = 32) { reserve(expected); }

  /// Number of keys; they are numbered from 0.
  std::size_t size() const { return size_; }

  /// Number of a key, or kNone.
  std::uint32_t find(const Key& key) const { return slots_[slot_of(key, voxel_hash(key))].number; }

  /// Number of a key; a new key gets the number size(). `hash`: voxel_hash(key).
  std::uint32_t insert(const Key& key, std::uint32_t hash) {
    if (2 * size_ >= slots_.size()) grow();
    const std::size_t at = slot_of(key, hash);
    if (slots_[at].number == kNone) slots_[at] = {key, static_cast<std::uint32_t>(size_++)};
    Slot& first = slots_[first_of(hash)];
    std::swap(first, slots_[at]);
    return first.number;
  }
  std::uint32_t insert(const Key& key) { return insert(key, voxel_hash(key)); }

  /// The slot where a search begins. It holds the key that was inserted last among those that begin
  /// there, or Key() if it is empty: a short cut for keys that come again and again.
  const Slot& first_slot(std::uint32_t hash) const { return slots_[first_of(hash)]; }

  /// Makes place for `count` keys, those in the table included.
  void reserve(std::size_t count) {
    while (2 * count > slots_.size()) grow();
  }

  /// Removes all keys and keeps the memory.
  void clear() {
    slots_.assign(slots_.size(), Slot());
    size_ = 0;
  }

  std::size_t memory_bytes() const { return slots_.capacity() * sizeof(Slot); }

 private:
  std::size_t first_of(std::uint32_t hash) const { return hash >> shift_; }

  // The slot of a key, or the empty one where it belongs.
  std::size_t slot_of(const Key& key, std::uint32_t hash) const {
    std::size_t at = first_of(hash);
    while (slots_[at].number != kNone && !(slots_[at].key == key)) {
      at = (at + 1) & (slots_.size() - 1);
    }
    return at;
  }

  void grow() {
    constexpr std::size_t kFewest = 64;
    std::vector<Slot> old(slots_.empty() ? kFewest : 2 * slots_.size());
    old.swap(slots_);
    --shift_;
    for (const Slot& slot : old) {
      if (slot.number != kNone) slots_[slot_of(slot.key, voxel_hash(slot.key))] = slot;
    }
  }

  int shift_ = 27;  // 32 - log2 of the number of slots; one more before the first
  std::size_t size_ = 0;
  std::vector<Slot> slots_;
};

}  // namespace dynains
