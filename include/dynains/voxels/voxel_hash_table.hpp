// Keys and hashes of voxels of a regular grid, a hash table that numbers them, and components of
// touching ones.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"

namespace dynains {

/// Number of a key that a table does not hold, and end of a list of indices.
inline constexpr std::uint32_t kNoIndex = 0xFFFFFFFFU;

/// The three indices of a voxel in its grid as one number, ordered by x, then y, then z. Each index
/// lies in [-2^20, 2^20).
using VoxelKey = std::uint64_t;

inline constexpr int kVoxelKeyBits = 21;  // of each index
inline constexpr std::int64_t kVoxelKeyOffset = std::int64_t{1} << (kVoxelKeyBits - 1);

constexpr VoxelKey voxel_key(std::int64_t x, std::int64_t y, std::int64_t z) {
  return static_cast<VoxelKey>(x + kVoxelKeyOffset) << (2 * kVoxelKeyBits) |
         static_cast<VoxelKey>(y + kVoxelKeyOffset) << kVoxelKeyBits |
         static_cast<VoxelKey>(z + kVoxelKeyOffset);
}

/// Difference between the keys of two voxels that are (dx, dy, dz) voxels apart.
constexpr VoxelKey voxel_key_step(std::int64_t dx, std::int64_t dy, std::int64_t dz) {
  return (static_cast<VoxelKey>(dx) << (2 * kVoxelKeyBits)) +
         (static_cast<VoxelKey>(dy) << kVoxelKeyBits) + static_cast<VoxelKey>(dz);
}

/// Index of a voxel along `axis`: 0 (x), 1 (y) or 2 (z).
constexpr std::int64_t voxel_index(VoxelKey key, int axis) {
  constexpr VoxelKey kMask = (VoxelKey{1} << kVoxelKeyBits) - 1;
  return static_cast<std::int64_t>(key >> ((2 - axis) * kVoxelKeyBits) & kMask) - kVoxelKeyOffset;
}

/// The voxel of edge `edge` around a point, in the unit of `edge`. `Point`: a vector of doubles.
template <class Point>
VoxelKey voxel_at(const Point& point, double edge) {
  const auto index = [&](int axis) { return detail::floor_to<std::int64_t>(point[axis] / edge); };
  return voxel_key(index(0), index(1), index(2));
}

/// Hash of a key. The upper bits are mixed best.
constexpr std::uint32_t voxel_hash(VoxelKey key) {
  // 2^64 over the golden ratio.
  return static_cast<std::uint32_t>(((key ^ key >> 32U) * 0x9E3779B97F4A7C15ULL) >> 32U);
}

namespace detail {

constexpr std::int32_t multiply(std::int32_t a, std::int32_t b) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) * static_cast<std::uint32_t>(b));
}

/// Hash of three numbers, for one triple or for a pack of triples. The upper bits are mixed best.
template <class Int>
Int mixed_hash(const Int& a, const Int& b, const Int& c) {
  const auto factor = [](std::uint32_t odd) { return static_cast<std::int32_t>(odd); };
  const Int all = multiply(a, factor(0x9E3779B1U)) ^ multiply(b, factor(0x85EBCA77U)) ^
                  multiply(c, factor(0xC2B2AE3DU));
  return multiply(all ^ (all >> 15), factor(0x2C1B3C6DU));
}

}  // namespace detail

/// Hash table that numbers keys: open addressing with linear probing, at most half of the slots in
/// use. Single keys cannot be erased. `Key`: VoxelKey, or a type with operator== and a function
/// voxel_hash(key).
template <class Key = VoxelKey>
class VoxelHashTable {
 public:
  struct Slot {
    Key key = Key();
    std::uint32_t number = kNoIndex;
  };

  /// Reserves memory for `expected` keys.
  explicit VoxelHashTable(std::size_t expected = 32) { reserve(expected); }

  /// Number of keys. The keys are numbered from 0 in the order of insertion.
  std::size_t size() const { return size_; }

  /// Number of a key, or kNoIndex.
  std::uint32_t find(const Key& key) const { return slots_[slot_of(key, voxel_hash(key))].number; }

  /// Asks for the memory that find() and insert() read first.
  void prefetch(const Key& key) const { __builtin_prefetch(&first_slot(voxel_hash(key))); }

  /// Number of a key; adds a new key with the number size(). `hash`: voxel_hash(key).
  std::uint32_t insert(const Key& key, std::uint32_t hash) {
    if (2 * size_ >= slots_.size()) grow();
    Slot& slot = slots_[slot_of(key, hash)];
    Slot& first = slots_[first_of(hash)];
    const std::uint32_t number =
        slot.number == kNoIndex ? static_cast<std::uint32_t>(size_++) : slot.number;
    slot = first;
    first = {key, number};
    return number;
  }
  std::uint32_t insert(const Key& key) { return insert(key, voxel_hash(key)); }

  /// The slot where a search for `hash` begins: a short cut for keys that are inserted repeatedly.
  /// It holds the last inserted key among the keys whose search begins there, or Key() if it is
  /// empty.
  const Slot& first_slot(std::uint32_t hash) const { return slots_[first_of(hash)]; }

  /// Reserves memory for `count` keys in total.
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

  // The slot of a key, or the empty slot where the key would be inserted.
  std::size_t slot_of(const Key& key, std::uint32_t hash) const {
    std::size_t at = first_of(hash);
    while (slots_[at].number != kNoIndex && !(slots_[at].key == key)) {
      at = (at + 1) & (slots_.size() - 1);
    }
    return at;
  }

  void grow() {
    std::vector<Slot> old(slots_.empty() ? 64 : 2 * slots_.size());
    old.swap(slots_);
    --shift_;
    for (const Slot& slot : old) {
      if (slot.number != kNoIndex) slots_[slot_of(slot.key, voxel_hash(slot.key))] = slot;
    }
  }

  int shift_ = 27;  // 32 - log2 of the number of slots; 27 before the first slots exist
  std::size_t size_ = 0;
  std::vector<Slot> slots_;
};

/// Calls `visit(key)` for a voxel and the 26 that touch it.
template <class Visitor>
void for_each_touching(VoxelKey key, Visitor&& visit) {
  for (int i = 0; i < 27; ++i) visit(key + voxel_key_step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
}

/// Finds components of touching voxels. Later calls reuse the memory.
class ComponentSearch {
 public:
  /// Calls `visit(members)` for each component; members are numbers in `keys`. `numbers` has the
  /// number of each key.
  template <class Visitor>
  void for_each(const std::vector<VoxelKey>& keys, const VoxelHashTable<>& numbers,
                Visitor&& visit) {
    is_done_.assign(keys.size(), false);
    for (std::uint32_t first = 0; first < keys.size(); ++first) {
      if (is_done_[first]) continue;
      is_done_[first] = true;
      members_.assign(1, first);
      for (std::size_t i = 0; i < members_.size(); ++i) {
        for_each_touching(keys[members_[i]], [&](VoxelKey key) {
          const std::uint32_t next = numbers.find(key);
          if (next == kNoIndex || is_done_[next]) return;
          is_done_[next] = true;
          members_.push_back(next);
        });
      }
      visit(members_);
    }
  }

 private:
  std::vector<bool> is_done_;
  std::vector<std::uint32_t> members_;
};

}  // namespace dynains
