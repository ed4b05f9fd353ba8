// A memory of the grid cells of one scan.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "dynains/evidence/voxel_hash.hpp"
#include "dynains/simd/wide_lanes.hpp"

namespace dynains::detail {

/// Cells of some points, each with the instance that it belongs to.
template <std::size_t kCount>
struct CellBlock {
  std::array<std::int32_t, kCount> xy, z, instance, hash;
};

/// A hash table of cells, by open addressing, which numbers them as they are met. What was met last
/// stands in its first place, so that points that come in the order of small patches find it there.
class VoxelHashTable {
 public:
  static constexpr int kHalf = 16;  ///< bits of x and of y, which share a number

  struct Entry {
    std::int32_t xy = 0;
    std::int32_t z = 0;
    std::int32_t instance = -1;
    std::int32_t hash = 0;
    std::uint32_t number = 0;

    /// Whether it is of another cell than the i-th one of a block.
    template <std::size_t kCount>
    bool is_other(const CellBlock<kCount>& cells, std::size_t i) const {
      return ((xy ^ cells.xy[i]) | (z ^ cells.z[i]) | (instance ^ cells.instance[i])) != 0;
    }
  };

  /// Forgets all. What stands for no cell shares an entry of its own, which stays as it is.
  void clear() {
    entries_.assign(size() + 1, Entry());
    count_ = 0;
  }

  /// How many cells there are, numbered from 1 on.
  std::uint32_t count() const { return count_; }

  /// Makes sure that so many more cells leave half of the table empty.
  void make_room_for(std::size_t cells) {
    while (2 * (count_ + cells) > size()) grow();
  }

  /// Where the i-th cell of a block stands if it was met last of those that share its place.
  template <std::size_t kCount>
  const Entry& at(const CellBlock<kCount>& cells, std::size_t i) const {
    return entries_[place_of(cells.hash[i])];
  }

  /// Its number; it stands in the first place from now on.
  template <std::size_t kCount>
  std::uint32_t find(const CellBlock<kCount>& cells, std::size_t i) {
    std::size_t place = place_of(cells.hash[i]);
    Entry& first = entries_[place];
    while (entries_[place].instance >= 0 && entries_[place].is_other(cells, i)) {
      place = next(place);
    }
    std::swap(first, entries_[place]);
    if (first.instance < 0) {
      first = {cells.xy[i], cells.z[i], cells.instance[i], cells.hash[i], ++count_};
    }
    return first.number;
  }

  /// Puts eight cells to a block: `x` and `y` within 16 bits. Where `is_cell` is false, they stand
  /// for none.
  template <class Mask, class Int, std::size_t kCount>
  static void put(const Mask& is_cell, const Int& x, const Int& y, const Int& z,
                  const Int& instance, std::size_t i, CellBlock<kCount>& cells) {
    const Int xy = keep(is_cell, (x << kHalf) + (y & Int((1 << kHalf) - 1)));
    const Int z_kept = keep(is_cell, z);
    xy.store(&cells.xy[i]);
    z_kept.store(&cells.z[i]);
    select(is_cell, instance, Int(-1)).store(&cells.instance[i]);
    select(is_cell, mixed_hash(xy, z_kept, instance) & Int(kMost), Int(kNone))
        .store(&cells.hash[i]);
  }

 private:
  static constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();
  static constexpr std::int32_t kNone = std::numeric_limits<std::int32_t>::min();

  std::size_t size() const { return std::size_t{1} << bits_; }
  // The upper bits of 31; one behind the table for kNone.
  std::size_t place_of(std::int32_t hash) const {
    return static_cast<std::uint32_t>(hash) >> (31 - bits_);
  }
  std::size_t next(std::size_t place) const { return (place + 1) & (size() - 1); }

  void grow() {
    std::vector<Entry> entries = std::move(entries_);
    ++bits_;
    entries_.assign(size() + 1, Entry());
    for (const Entry& entry : entries) {
      if (entry.instance < 0) continue;
      std::size_t place = place_of(entry.hash);
      while (entries_[place].instance >= 0) place = next(place);
      entries_[place] = entry;
    }
  }

  int bits_ = 13;
  std::uint32_t count_ = 0;
  std::vector<Entry> entries_;
};

}  // namespace dynains::detail
