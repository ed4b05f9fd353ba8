// Packed voxel keys of a world-aligned grid, and a flat hash table over them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/errors.hpp"

namespace dynains::evaluation::detail {

/// Three 21-bit cell numbers, biased to be positive, in one word. Neighbouring cells differ by
/// constants, see kNeighbours.
using VoxelKey = std::uint64_t;

inline constexpr int kKeyBits = 21;
inline constexpr std::int64_t kKeyBias = std::int64_t{1} << (kKeyBits - 1);
/// Key of points outside of the grid.
inline constexpr VoxelKey kNoKey = ~VoxelKey{0};

/// Cells [i * edge, (i + 1) * edge) per axis of the world frame. Keys count from the cell of an
/// anchor point, so that large coordinates (UTM) fit; the grid itself does not move with it.
class VoxelGrid {
 public:
  /// Throws PoseError if the cell number of the anchor cannot be exact.
  VoxelGrid(double edge, const Eigen::Vector3d& anchor) : edge_(edge) {
    for (int axis = 0; axis < 3; ++axis) {
      const double cell = std::floor(anchor[axis] / edge);
      if (!(std::abs(cell) < 0x1p52)) {
        throw PoseError("the first pose lies too far from the world's origin for a grid of " +
                        std::to_string(edge) + " m");
      }
      anchor_[static_cast<std::size_t>(axis)] = static_cast<std::int64_t>(cell);
    }
  }

  double edge() const { return edge_; }

  /// kNoKey for a point that is not finite or that lies 2^20 cells or more from the anchor along
  /// some axis (210 km at 0.2 m).
  VoxelKey key(const Eigen::Vector3d& p_world) const {
    VoxelKey key = 0;
    for (int axis = 2; axis >= 0; --axis) {
      const double cell = p_world[axis] / edge_;
      if (!(std::abs(cell) < 0x1p53)) return kNoKey;
      // floor() without a call into libm, which the baseline instruction set would need.
      auto number = static_cast<std::int64_t>(cell);
      number -= static_cast<double>(number) > cell;
      number += kKeyBias - anchor_[static_cast<std::size_t>(axis)];
      // One cell at either end is kept free for the neighbours.
      if (number < 1 || number > 2 * kKeyBias - 2) return kNoKey;
      key = (key << kKeyBits) | static_cast<VoxelKey>(number);
    }
    return key;
  }

  /// Lower corner of a voxel.
  Eigen::Vector3d corner(VoxelKey key) const {
    Eigen::Vector3d corner;
    for (int axis = 0; axis < 3; ++axis) {
      const VoxelKey field = (key >> (axis * kKeyBits)) & ((VoxelKey{1} << kKeyBits) - 1);
      const std::int64_t number =
          static_cast<std::int64_t>(field) - kKeyBias + anchor_[static_cast<std::size_t>(axis)];
      corner[axis] = static_cast<double>(number) * edge_;
    }
    return corner;
  }

 private:
  double edge_;
  std::array<std::int64_t, 3> anchor_{};  // cell numbers
};

/// Offsets from a key to itself (first) and to its 26 neighbours.
inline constexpr std::array<VoxelKey, 27> neighbour_offsets() {
  std::array<VoxelKey, 27> offsets{};
  std::size_t next = 1;
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        if (x == 0 && y == 0 && z == 0) continue;
        const std::int64_t step = std::int64_t{x} +
                                  std::int64_t{y} * (std::int64_t{1} << kKeyBits) +
                                  std::int64_t{z} * (std::int64_t{1} << (2 * kKeyBits));
        offsets[next++] = static_cast<VoxelKey>(step);
      }
    }
  }
  return offsets;
}
inline constexpr std::array<VoxelKey, 27> kNeighbours = neighbour_offsets();

/// Numbers keys 0, 1, 2, ... in the order of insertion. Open addressing; single keys cannot be
/// erased.
class VoxelIndex {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffU;

  explicit VoxelIndex(std::size_t expected = 64) { rehash(expected * 2); }

  std::size_t size() const { return size_; }

  /// Number of the key, or kNone.
  std::uint32_t find(VoxelKey key) const {
    for (std::size_t slot = home(key);; slot = (slot + 1) & mask_) {
      if (slots_[slot].number == kNone) return kNone;
      if (slots_[slot].key == key) return slots_[slot].number;
    }
  }

  /// Number of the key; size() grows if it is new.
  std::uint32_t insert(VoxelKey key) {
    if (2 * (size_ + 1) > slots_.size()) rehash(slots_.size() * 2);
    std::size_t slot = home(key);
    while (slots_[slot].number != kNone) {
      if (slots_[slot].key == key) return slots_[slot].number;
      slot = (slot + 1) & mask_;
    }
    slots_[slot] = {key, static_cast<std::uint32_t>(size_)};
    return static_cast<std::uint32_t>(size_++);
  }

  void clear() {
    for (Slot& slot : slots_) slot.number = kNone;
    size_ = 0;
  }

 private:
  struct Slot {
    VoxelKey key = 0;
    std::uint32_t number = kNone;
  };

  std::size_t home(VoxelKey key) const {
    // Multiplicative hashing: the product's upper bits depend on every bit of the key.
    return static_cast<std::size_t>((key * 0x9e3779b97f4a7c15ULL) >> shift_);
  }

  void rehash(std::size_t wanted) {
    int bits = 6;
    while ((std::size_t{1} << bits) < wanted) ++bits;
    std::vector<Slot> old(std::size_t{1} << bits);
    old.swap(slots_);
    mask_ = slots_.size() - 1;
    shift_ = 64 - bits;
    for (const Slot& entry : old) {
      if (entry.number == kNone) continue;
      std::size_t slot = home(entry.key);
      while (slots_[slot].number != kNone) slot = (slot + 1) & mask_;
      slots_[slot] = entry;
    }
  }

  std::vector<Slot> slots_;
  std::size_t mask_ = 0;
  int shift_ = 58;
  std::size_t size_ = 0;
};

}  // namespace dynains::evaluation::detail
