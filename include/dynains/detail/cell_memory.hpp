// A direct-mapped memory of grid cells met lately: nothing is ever searched.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/detail/wide_lanes.hpp"

namespace dynains::detail {

/// Cells of some points, each with the instance that it belongs to, where they are remembered, and
/// the part of the cell in which the point lies.
template <std::size_t kCount>
struct CellBlock {
  std::array<std::int32_t, kCount> xy, z, instance, slot, part;
};

/// Gives cells back what was noted for them, unless another cell took their place.
class CellMemory {
 public:
  static constexpr int kHalf = 16;               ///< bits of x and of y, which share a number
  static constexpr int kPartBits = 2;            ///< of a part's place along each axis
  static constexpr int kParts = 1 << kPartBits;  ///< per axis; beyond, they begin again
  static constexpr std::uint64_t kAllParts = ~std::uint64_t{0};

  struct Entry {
    std::int32_t xy = 0;
    std::int32_t z = 0;
    std::int32_t instance = -1;
    std::uint32_t number = 0;
    std::uint64_t parts = kAllParts;  ///< that need not be looked at again, a bit each

    /// Whether it is of another cell than the i-th one of a block.
    template <std::size_t kCount>
    bool is_other(const CellBlock<kCount>& cells, std::size_t i) const {
      return ((xy ^ cells.xy[i]) | (z ^ cells.z[i]) | (instance ^ cells.instance[i])) != 0;
    }
    template <std::size_t kCount>
    bool has_part(const CellBlock<kCount>& cells, std::size_t i) const {
      return (parts >> static_cast<unsigned>(cells.part[i]) & 1U) != 0;
    }
  };

  /// Forgets all. What stands for no cell shares an entry of its own, which stays as it is.
  void clear() { entries_.assign(kSlots + 1, Entry()); }

  template <std::size_t kCount>
  Entry& at(const CellBlock<kCount>& cells, std::size_t i) {
    return entries_[static_cast<std::size_t>(cells.slot[i])];
  }

  /// Puts eight cells to a block: `x` and `y` within 16 bits, `part` below 64. Where `is_cell` is
  /// false, they stand for none.
  template <class Mask, class Int, std::size_t kCount>
  static void put(const Mask& is_cell, const Int& x, const Int& y, const Int& z,
                  const Int& instance, const Int& part, std::size_t i, CellBlock<kCount>& cells) {
    const Int xy = keep(is_cell, (x << kHalf) + (y & Int((1 << kHalf) - 1)));
    const Int z_kept = keep(is_cell, z);
    xy.store(&cells.xy[i]);
    z_kept.store(&cells.z[i]);
    select(is_cell, instance, Int(-1)).store(&cells.instance[i]);
    select(is_cell, slot_of(xy, z_kept, instance), Int(kSlots)).store(&cells.slot[i]);
    part.store(&cells.part[i]);
  }

 private:
  static constexpr std::int32_t kSlots = 1 << 12;

  // The products of odd numbers differ most in their upper bits.
  template <class Int>
  static Int slot_of(const Int& xy, const Int& z, const Int& instance) {
    const auto factor = [](std::uint32_t odd) { return static_cast<std::int32_t>(odd); };
    const Int all = multiply(xy, factor(0x9E3779B1U)) ^ multiply(z, factor(0x85EBCA77U)) ^
                    multiply(instance, factor(0xC2B2AE3DU));
    return (multiply(all ^ (all >> 15), factor(0x2C1B3C6DU)) >> 18) & Int(kSlots - 1);
  }

  std::vector<Entry> entries_;
};

}  // namespace dynains::detail
