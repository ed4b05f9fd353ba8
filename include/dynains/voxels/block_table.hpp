// Storage of the static map: a chunked vector and a hash table of blocks of voxels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::detail {

/// Vector that grows by chunks. Elements never move, so references stay valid. A push_back()
/// allocates at most one chunk. `T`: trivially constructible. `kChunk`: elements per chunk.
template <class T, std::uint32_t kChunk>
class ChunkedVector {
 public:
  std::uint32_t size() const { return size_; }
  T& operator[](std::uint32_t i) { return chunks_[i / kChunk][i % kChunk]; }
  const T& operator[](std::uint32_t i) const { return chunks_[i / kChunk][i % kChunk]; }

  /// Appends an element and returns its index, at most 2^32 - 2. Throws std::length_error if the
  /// vector is full, and std::bad_alloc; in both cases the vector is unchanged.
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

/// Indices of a block in the world frame, in blocks. Each has 32 bits: the 21 bits of a VoxelKey
/// are too few for the smallest voxels at national grid coordinates.
struct BlockIndex {
  std::int32_t x, y, z;
  friend bool operator==(const BlockIndex& a, const BlockIndex& b) {
    return ((a.x ^ b.x) | (a.y ^ b.y) | (a.z ^ b.z)) == 0;
  }
};

/// Hash table that numbers blocks in the order of their insertion, and stores their data.
///
/// Linear hashing (Litwin, 1980): each new block splits one bucket, so the time of an insertion
/// does not grow with the table. VoxelHashTable instead rebuilds the whole table, which takes tens
/// of milliseconds for half a million keys.
template <class Data>
class BlockTable {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  struct Block {
    Data data;
    BlockIndex index;
    std::uint32_t next;  // next block of the bucket, or kNone
  };

  std::uint32_t size() const { return blocks_.size(); }
  Block& operator[](std::uint32_t block) { return blocks_[block]; }
  const Block& operator[](std::uint32_t block) const { return blocks_[block]; }

  /// Number of a block, or kNone.
  std::uint32_t find(const BlockIndex& index) const { return find(index, hash_of(index)); }

  /// Number of a block; adds a new block with `data`. Throws std::length_error beyond 2^32 - 2
  /// blocks, and std::bad_alloc.
  std::uint32_t find_or_add(const BlockIndex& index, const Data& data) {
    const std::uint32_t hash = hash_of(index);
    const std::uint32_t found = find(index, hash);
    return found == kNone ? add(index, data, hash) : found;
  }

  std::size_t memory_bytes() const { return blocks_.memory_bytes() + buckets_.memory_bytes(); }

 private:
  // The lower bits are well mixed.
  static std::uint32_t hash_of(const BlockIndex& index) {
    const auto hash = static_cast<std::uint32_t>(mixed_hash(index.x, index.y, index.z));
    return hash ^ (hash >> 13);
  }

  // A round of splits doubles the number of buckets, from round_begin_ to 2 * round_begin_.
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

  // The table has one bucket per block: a search visits one or two blocks on average.
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
  ChunkedVector<std::uint32_t, 1024> buckets_;  // by bucket: its first block, or kNone
  ChunkedVector<Block, 512> blocks_;
};

}  // namespace dynains::detail
