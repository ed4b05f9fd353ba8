// Blocks of voxels by their index in the world: storage and hash table of the static map.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include "dynains/stage/voxel_hash_table.hpp"

namespace dynains::detail {

/// Grows by chunks that never move: references stay valid, and a push allocates one chunk at most.
/// `T` is trivially constructible; `kChunk`: elements.
template <class T, std::uint32_t kChunk>
class ChunkedVector {
 public:
  std::uint32_t size() const { return size_; }
  T& operator[](std::uint32_t i) { return chunks_[i / kChunk][i % kChunk]; }
  const T& operator[](std::uint32_t i) const { return chunks_[i / kChunk][i % kChunk]; }

  /// Returns the index of the new element, at most 2^32 - 2. Throws std::length_error beyond it,
  /// and std::bad_alloc; then the vector is unchanged.
  std::uint32_t push_back(const T& value) {
    if (size_ == chunks_.size() * kChunk) add_chunk();
    (*this)[size_] = value;
    return size_++;
  }

  std::size_t memory_bytes() const {
    return chunks_.size() * kChunk * sizeof(T) + chunks_.capacity() * sizeof(chunks_[0]);
  }

 private:
  void add_chunk() {
    constexpr std::size_t kMostChunks = std::numeric_limits<std::uint32_t>::max() / kChunk;
    if (chunks_.size() == kMostChunks) throw std::length_error("2^32 - 1 elements are too many");
    chunks_.emplace_back(new T[kChunk]);
  }

  std::vector<std::unique_ptr<T[]>> chunks_;
  std::uint32_t size_ = 0;
};

/// Indices of a block in the world, counted in blocks: 32 bits each, since a VoxelKey is too narrow
/// for the smallest voxels at national grid coordinates.
struct BlockIndex {
  std::int32_t x, y, z;
  friend bool operator==(const BlockIndex& a, const BlockIndex& b) {
    return ((a.x ^ b.x) | (a.y ^ b.y) | (a.z ^ b.z)) == 0;
  }
};

/// Hash table that numbers blocks in the order in which they are added, and keeps their data.
///
/// Linear hashing (Litwin, 1980): each new block splits one bucket, so that no frame pays for a
/// rebuild of the whole table. VoxelHashTable does rebuild: tens of milliseconds for half a million
/// keys.
template <class Data>
class BlockTable {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  struct Block {
    Data data;
    BlockIndex index;
    std::uint32_t next;  // in the bucket; kNone behind the last
  };

  std::uint32_t size() const { return blocks_.size(); }
  Block& operator[](std::uint32_t block) { return blocks_[block]; }
  const Block& operator[](std::uint32_t block) const { return blocks_[block]; }

  /// Number of a block, or kNone.
  std::uint32_t find(const BlockIndex& index) const { return find(index, hash_of(index)); }

  /// Number of a block, which is added with `data` if it is new. Throws std::length_error beyond
  /// 2^32 - 2 blocks, and std::bad_alloc.
  std::uint32_t find_or_add(const BlockIndex& index, const Data& data) {
    const std::uint32_t hash = hash_of(index);
    const std::uint32_t found = find(index, hash);
    return found == kNone ? add(index, data, hash) : found;
  }

  std::size_t memory_bytes() const { return blocks_.memory_bytes() + buckets_.memory_bytes(); }

 private:
  // Well mixed in the lower bits.
  static std::uint32_t hash_of(const BlockIndex& index) {
    const auto hash = static_cast<std::uint32_t>(mixed_hash(index.x, index.y, index.z));
    return hash ^ (hash >> 13);
  }

  // Each round of splits doubles the number of buckets, from `round_begin_` on.
  std::uint32_t bucket_of(std::uint32_t hash) const {
    const std::uint32_t bucket = hash & (2 * round_begin_ - 1);
    return bucket < buckets_.size() ? bucket : bucket - round_begin_;
  }

  std::uint32_t find(const BlockIndex& index, std::uint32_t hash) const {
    if (buckets_.size() == 0) return kNone;
    std::uint32_t block = buckets_[bucket_of(hash)];
    while (block != kNone && !(blocks_[block].index == index)) block = blocks_[block].next;
    return block;
  }

  // One bucket per block: a search looks at one or two blocks on average.
  std::uint32_t add(const BlockIndex& index, const Data& data, std::uint32_t hash) {
    split_bucket();
    std::uint32_t& first = buckets_[bucket_of(hash)];
    first = blocks_.push_back({data, index, first});
    return first;
  }

  void split_bucket() {
    if (buckets_.size() == 2 * round_begin_) round_begin_ *= 2;
    const std::uint32_t added = buckets_.push_back(kNone);
    if (added == 0) return;
    std::uint32_t* link = &buckets_[added - round_begin_];
    std::uint32_t* moved = &buckets_[added];
    while (*link != kNone) {
      Block& block = blocks_[*link];
      if (bucket_of(hash_of(block.index)) == added) {
        *moved = *link;
        *link = block.next;
        block.next = kNone;
        moved = &block.next;
      } else {
        link = &block.next;
      }
    }
  }

  std::uint32_t round_begin_ = 1;
  ChunkedVector<std::uint32_t, 1024> buckets_;  // first block of each
  ChunkedVector<Block, 512> blocks_;
};

}  // namespace dynains::detail
