// Tiles of a recording. Those far from the sensor are moved to a store.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "dynains/recording/byte_store.hpp"
#include "dynains/recording/world_cells.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// Values by voxel of a tile, in the order of their insertion.
template <class Value>
struct VoxelTile {
  VoxelHashTable<> numbers;
  std::vector<VoxelKey> keys;
  std::vector<Value> values;

  /// Number of a voxel; a new one has the value Value().
  std::uint32_t add(VoxelKey key) {
    const std::uint32_t number = numbers.insert(key);
    if (number == values.size()) {
      values.emplace_back();
      keys.push_back(key);
    }
    return number;
  }
  /// Null: the voxel has no value.
  const Value* find(VoxelKey key) const {
    const std::uint32_t number = numbers.find(key);
    return number == kNoIndex ? nullptr : &values[number];
  }
  std::size_t size() const { return keys.size(); }
  std::size_t memory_bytes() const {
    return numbers.memory_bytes() + keys.capacity() * sizeof(VoxelKey) +
           values.capacity() * sizeof(Value);
  }

  /// Adds all to `bytes`.
  void pack(std::vector<std::uint8_t>& bytes) const {
    const std::uint64_t count = keys.size();
    add_bytes(&count, 1, bytes);
    add_bytes(keys.data(), count, bytes);
    add_bytes(values.data(), count, bytes);
  }
  /// Takes what pack() added. Returns its end.
  const std::uint8_t* unpack(const std::uint8_t* bytes) {
    std::uint64_t count;
    std::memcpy(&count, bytes, sizeof(count));
    keys.resize(count);
    values.resize(count);
    const std::uint8_t* const begin_values = bytes + sizeof(count) + count * sizeof(VoxelKey);
    std::copy(bytes + sizeof(count), begin_values, reinterpret_cast<std::uint8_t*>(keys.data()));
    std::copy_n(begin_values, count * sizeof(Value),
                reinterpret_cast<std::uint8_t*>(values.data()));
    numbers.reserve(count);
    for (const VoxelKey key : keys) numbers.insert(key);
    return begin_values + count * sizeof(Value);
  }
};

/// Tiles by index, each as a VoxelTile. References to a tile are valid until free_far() frees it.
template <class Tile>
class PagedTiles {
 public:
  /// `budget`: bytes of the tiles that stay in memory, if the others are far. The store outlives
  /// this. `edge`: m, of a tile.
  PagedTiles(ByteStore& store, std::size_t budget, double edge = kTileEdge)
      : store_(&store), budget_(budget), edge_(edge) {}

  /// The tile, which is new or not, to be changed. Throws what the store throws.
  Tile& at(const TileIndex& index) {
    if (!is_recent(index)) take_recent(*entries_.try_emplace(index).first);
    recent_->is_changed = true;
    return *recent_->tile;
  }
  /// Null: there is no such tile. Throws what the store throws.
  const Tile* find(const TileIndex& index) {
    if (!is_recent(index)) {
      const auto found = entries_.find(index);
      if (found == entries_.end()) return nullptr;
      take_recent(*found);
    }
    return &*recent_->tile;
  }

  /// Calls `visit(index)` for all tiles, in the order of their indices.
  template <class Visitor>
  void for_each_index(Visitor&& visit) const {
    for (const auto& entry : entries_) visit(entry.first);
  }
  /// Number of values.
  std::size_t size() const {
    std::size_t size = 0;
    for (const auto& entry : entries_) {
      size += entry.second.tile ? entry.second.tile->size() : entry.second.count;
    }
    return size;
  }

  /// Distance of a tile from a position (m, world frame) along the axis where it is larger, m.
  double distance(const TileIndex& index, const Eigen::Vector3d& position) const {
    const Eigen::Vector3d away = position - middle(index);
    return away.head<2>().cwiseAbs().maxCoeff() - 0.5 * edge_;
  }
  /// m, world frame; z is 0.
  Eigen::Vector3d middle(const TileIndex& index) const {
    return {edge_ * (static_cast<double>(index[0]) + 0.5),
            edge_ * (static_cast<double>(index[1]) + 0.5), 0.0};
  }

  /// Frees the tiles farthest from a position (m, world frame) until the others keep to the budget.
  /// Those within `keep` (m) stay. Throws what the store throws.
  void free_far(const Eigen::Vector3d& position, double keep) {
    std::size_t bytes = 0;
    far_.clear();
    for (auto& [index, entry] : entries_) {
      if (!entry.tile) continue;
      bytes += entry.tile->memory_bytes();
      const double metres = distance(index, position);
      if (metres > keep) far_.emplace_back(metres, &entry);
    }
    if (bytes <= budget_) return;
    std::sort(far_.rbegin(), far_.rend());
    for (const auto& far : far_) {
      if (bytes <= budget_ - budget_ / 4) return;
      bytes -= far.second->tile->memory_bytes();
      store(*far.second);
    }
  }

  /// Puts all tiles into the store. Throws what it throws.
  void rest() {
    for (auto& entry : entries_) {
      if (entry.second.tile) store(entry.second);
    }
  }

 private:
  struct Entry {
    std::optional<Tile> tile;  // in memory
    bool is_changed = false;   // since it was stored
    std::uint64_t offset = 0;  // in the store
    std::size_t size = 0, count = 0;
  };

  bool is_recent(const TileIndex& index) const {
    return recent_ != nullptr && recent_index_[0] == index[0] && recent_index_[1] == index[1];
  }
  void take_recent(std::pair<const TileIndex, Entry>& entry) {
    load(entry.second);
    recent_index_ = entry.first;
    recent_ = &entry.second;
  }

  void load(Entry& entry) {
    if (entry.tile) return;
    Tile tile;
    if (entry.size > 0) {
      store_->read(entry.offset, entry.size, bytes_);
      tile.unpack(bytes_.data());
    }
    entry.tile = std::move(tile);
    entry.is_changed = false;
  }

  void store(Entry& entry) {
    if (entry.is_changed || entry.size == 0) {
      bytes_.clear();
      entry.tile->pack(bytes_);
      entry.offset = store_->append(bytes_);
      entry.size = bytes_.size();
      entry.count = entry.tile->size();
    }
    entry.tile.reset();
    recent_ = nullptr;
  }

  ByteStore* store_;
  std::size_t budget_;
  double edge_;                         // m
  std::map<TileIndex, Entry> entries_;  // its elements do not move
  Entry* recent_ = nullptr;             // in memory
  TileIndex recent_index_ = {};
  std::vector<std::uint8_t> bytes_;
  std::vector<std::pair<double, Entry*>> far_;
};

}  // namespace dynains
