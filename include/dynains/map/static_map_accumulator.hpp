// Static map (Eq. 1): measured points in the world frame, at most one per voxel.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/simd/pack_geometry.hpp"
#include "dynains/simd/pack_loops.hpp"
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
    if (chunks_.size() == kNoIndex / kChunk)
      throw std::length_error("2^32 - 1 elements are too many");
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

/// Voxels of the map that are stored together, and the list of their points.
struct MapBlock {
  BlockIndex index;
  std::uint64_t occupied;  ///< one bit per voxel
  std::uint32_t first;     ///< first point of the block, or kNoIndex
  std::uint32_t next;      ///< next block of the bucket, or kNoIndex
};

/// Hash table that numbers blocks in the order of their insertion. Blocks never move in memory.
///
/// Linear hashing (Litwin, 1980): each new block splits one bucket, so the time of an insertion
/// does not grow with the table. VoxelHashTable instead rebuilds the whole table, which takes tens
/// of milliseconds for half a million keys.
class BlockTable {
 public:
  std::uint32_t size() const { return blocks_.size(); }
  const MapBlock& operator[](std::uint32_t block) const { return blocks_[block]; }

  /// The block of an index; adds a block without points. Throws std::length_error beyond 2^32 - 2
  /// blocks, and std::bad_alloc.
  MapBlock& find_or_add(const BlockIndex& index) {
    const std::uint32_t hash = hash_of(index);
    std::uint32_t block = buckets_.size() == 0 ? kNoIndex : buckets_[bucket_of(hash)];
    while (block != kNoIndex && !(blocks_[block].index == index)) block = blocks_[block].next;
    return blocks_[block == kNoIndex ? add(index, hash) : block];
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

  // The table has one bucket per block: a search visits one or two blocks on average.
  std::uint32_t add(const BlockIndex& index, std::uint32_t hash) {
    split_bucket();
    std::uint32_t& first = buckets_[bucket_of(hash)];
    first = blocks_.push_back({index, 0, kNoIndex, first});
    return first;
  }

  void split_bucket() {
    if (buckets_.size() == 2 * round_begin_) round_begin_ *= 2;
    const std::uint32_t added = buckets_.push_back(kNoIndex);
    if (added == 0) return;
    std::uint32_t* link = &buckets_[added - round_begin_];
    std::uint32_t* moved = &buckets_[added];
    while (*link != kNoIndex) {
      MapBlock& block = blocks_[*link];
      if (bucket_of(hash_of(block.index)) == added) {
        *moved = *link;
        *link = block.next;
        block.next = kNoIndex;
        moved = &block.next;
      } else {
        link = &block.next;
      }
    }
  }

  std::uint32_t round_begin_ = 1;
  ChunkedVector<std::uint32_t, 1024> buckets_;  // by bucket: its first block, or kNoIndex
  ChunkedVector<MapBlock, 512> blocks_;
};

}  // namespace dynains::detail

namespace dynains {

/// Sparse voxel map. It stores the first measured point of each voxel, not the centre of the voxel.
///
/// Voxels are grouped in flat blocks of 8 x 4 x 2, because the ground is flat; the occupancy of a
/// block is one word. Points are stored in single precision relative to the corner of their block,
/// so their precision does not depend on the distance from the world origin. Stored points never
/// move in memory, and the table of blocks grows bucket by bucket, so the time of an insertion does
/// not grow with the map.
class StaticMapAccumulator {
 public:
  struct Config {
    double map_voxel = 0.2;  ///< m

    template <class Self, class Visitor>
    static void visit(Self& self, Visitor&& visitor) {
      visitor(Parameter{"map_voxel", self.map_voxel, closed(0, 10), "m",
                        "resolution: one measured point per voxel; 0 keeps all"});
    }

    /// Throws ConfigError.
    void validate() const {
      validate_parameters("StaticMapAccumulator", *this);
      if (map_voxel > 0.0 && map_voxel < 0.005) {
        throw ConfigError("StaticMapAccumulator.map_voxel = " + std::to_string(map_voxel) +
                          " must be 0 or at least 0.005 m");
      }
    }
  };

  StaticMapAccumulator() : StaticMapAccumulator(Config()) {}

  /// Throws ConfigError.
  explicit StaticMapAccumulator(const Config& config)
      : config_((config.validate(), config)),
        voxel_(config.map_voxel > 0.0 ? config.map_voxel : 0.2),
        keep_all_(config.map_voxel == 0.0) {}

  const Config& config() const { return config_; }

  /// Adds points of one scan. `points`: m, sensor frame. `keep`: by point, 0 for points to ignore;
  /// an empty `keep` adds all points. A voxel with a point ignores further points.
  /// `T_world_sensor`: rigid, translation within kMaxTranslation. Throws std::length_error beyond
  /// 2^32 - 2 points, and std::bad_alloc.
  void insert(PointsView points, Span<const std::uint8_t> keep, const Pose& T_world_sensor) {
    // Transforms to a corner next to the sensor, an exact multiple of all block edges, so that
    // single precision is sufficient.
    const double step = block_size(0);
    Pose T_corner_sensor = T_world_sensor;
    std::int32_t first_block[3];
    for (int axis = 0; axis < 3; ++axis) {
      const double corner = std::floor(T_world_sensor(axis, 3) / step);
      T_corner_sensor(axis, 3) -= corner * step;
      first_block[axis] =
          static_cast<std::int32_t>(corner) * (kBlockVoxels[0] / kBlockVoxels[axis]);
    }
    const detail::PackTransform to_corner(T_corner_sensor);
    const BlockIndex first = {first_block[0], first_block[1], first_block[2]};

    recent_.resize(kRecent, nullptr);
    Batch batch;
    for (std::size_t begin = 0; begin < points.size(); begin += kBatch) {
      const std::size_t count = std::min(kBatch, points.size() - begin);
      locate(points, begin, count, to_corner, first, batch);
      insert(count, keep.empty() ? keep : keep.subspan(begin, count), batch);
    }
  }

  /// Number of points.
  std::size_t size() const { return points_.size(); }
  bool empty() const { return size() == 0; }

  /// Removes all points and frees their memory.
  void clear() {
    blocks_ = {};
    points_ = {};
    recent_ = {};
  }

  /// Memory of the map, including its index, bytes.
  std::size_t memory_bytes() const {
    return points_.memory_bytes() + blocks_.memory_bytes() + recent_.size() * sizeof(recent_[0]);
  }

  /// Calls `visit(Eigen::Vector3d)` for every point (m, world frame).
  template <class Visitor>
  void for_each(Visitor&& visit) const {
    for (std::uint32_t block = 0; block < blocks_.size(); ++block) {
      const BlockIndex& index = blocks_[block].index;
      const Eigen::Vector3d corner(index.x * block_size(0), index.y * block_size(1),
                                   index.z * block_size(2));
      for (std::uint32_t i = blocks_[block].first; i != kNoIndex; i = points_[i].next) {
        const Point& point = points_[i];
        visit(Eigen::Vector3d(corner.x() + static_cast<double>(point.x),
                              corner.y() + static_cast<double>(point.y),
                              corner.z() + static_cast<double>(point.z)));
      }
    }
  }

 private:
  using BlockIndex = detail::BlockIndex;
  static constexpr int kBlockVoxels[3] = {8, 4, 2};

  struct Point {
    float x, y, z;       // m, relative to the corner of the block
    std::uint32_t next;  // next point of the block, or kNoIndex
  };

  // Size of recent_, a direct-mapped cache of blocks by the low bits of their indices. With
  // voxels of 0.2 m, these bits repeat every 51.2 m, and every 6.4 m in height.
  static constexpr std::size_t kRecent = std::size_t{32} * 64 * 16;

  // Consecutive points of a scan.
  static constexpr std::size_t kBatch = 512;
  struct Batch {
    alignas(64) float point[3][kBatch];         // m, relative to the corner of the block
    alignas(64) std::int32_t block[3][kBatch];  // indices in the world
    alignas(64) std::int32_t voxel[kBatch];     // index in the block
    alignas(64) std::int32_t recent[kBatch];    // place of the block in recent_
  };

  template <int kValue>
  using Constant = std::integral_constant<int, kValue>;

  // Edge of a block along an axis, m.
  double block_size(int axis) const { return voxel_ * kBlockVoxels[axis]; }

  // Computes blocks and voxels of `count` points of the scan, from `begin` on. `to_corner`:
  // transform from the sensor frame to the corner of the block `corner`.
  void locate(PointsView scan, std::size_t begin, std::size_t count,
              const detail::PackTransform& to_corner, const BlockIndex& corner,
              Batch& batch) const {
    using detail::PackConstant;
    const PackConstant scale(static_cast<float>(1.0 / voxel_));
    const PackConstant size[3] = {static_cast<float>(block_size(0)),
                                  static_cast<float>(block_size(1)),
                                  static_cast<float>(block_size(2))};
    alignas(64) std::int32_t first[3][detail::kPackWidth];
    std::fill_n(first[0], detail::kPackWidth, corner.x);
    std::fill_n(first[1], detail::kPackWidth, corner.y);
    std::fill_n(first[2], detail::kPackWidth, corner.z);
    const PointsView points = scan.subview(begin, count);
    detail::for_packs(count, [&](auto at) {
      using Float = typename decltype(at)::Float;
      using Int = typename decltype(at)::Int;
      const Float x = at.load(points.x.data());
      const Float y = at.load(points.y.data());
      const Float z = at.load(points.z.data());
      // Prefetches the next batch from main memory.
      const std::size_t ahead = std::min(begin + at.begin + kBatch, scan.size() - 1);
      for (const auto& axis : {scan.x, scan.y, scan.z}) __builtin_prefetch(&axis[ahead]);
      Int voxel_in_block(0), recent(0);
      const auto add_axis = [&](auto axis, auto voxel_bits, auto recent_bits) {
        const Float value = to_corner(axis, x, y, z);
        const Int voxel = floor(value * scale);
        // Arithmetic shifts and masks are floor division and remainder.
        const Int block = voxel >> voxel_bits;
        const Int block_in_world = block + Int::load(first[axis]);
        (value - to_float(block) * size[axis]).store(&batch.point[axis][at.begin]);
        block_in_world.store(&batch.block[axis][at.begin]);
        voxel_in_block = (voxel_in_block << voxel_bits) + (voxel & Int((1 << voxel_bits) - 1));
        recent = (recent << recent_bits) + (block_in_world & Int((1 << recent_bits) - 1));
      };
      add_axis(Constant<2>(), Constant<1>(), Constant<4>());
      add_axis(Constant<1>(), Constant<2>(), Constant<6>());
      add_axis(Constant<0>(), Constant<3>(), Constant<5>());
      voxel_in_block.store(&batch.voxel[at.begin]);
      recent.store(&batch.recent[at.begin]);
    });
  }

  // Inserts the points with a `keep` flag.
  void insert(std::size_t count, Span<const std::uint8_t> keep, const Batch& batch) {
    for (std::size_t i = 0; i < count; ++i) {
      __builtin_prefetch(recent_[static_cast<std::size_t>(batch.recent[i])]);
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (!keep.empty() && keep[i] == 0) continue;
      const BlockIndex index = {batch.block[0][i], batch.block[1][i], batch.block[2][i]};
      detail::MapBlock*& known = recent_[static_cast<std::size_t>(batch.recent[i])];
      if (known == nullptr || !(known->index == index)) {
        known = &blocks_.find_or_add(index);
      }
      detail::MapBlock& block = *known;
      const std::uint64_t bit = std::uint64_t{1} << batch.voxel[i];
      if ((block.occupied & bit) != 0 && !keep_all_) continue;
      block.first =
          points_.push_back({batch.point[0][i], batch.point[1][i], batch.point[2][i], block.first});
      block.occupied |= bit;
    }
  }

  Config config_;
  double voxel_;
  bool keep_all_;
  detail::BlockTable blocks_;
  detail::ChunkedVector<Point, 512> points_;
  std::vector<detail::MapBlock*> recent_;  // by cache slot: the last block, or null
};

}  // namespace dynains
