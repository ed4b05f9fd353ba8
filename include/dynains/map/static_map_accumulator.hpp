// Static map (Eq. 1): measured points in the world frame, at most one per voxel.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <limits>
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
  std::uint64_t occupied = 0;      ///< one bit per voxel
  std::uint32_t first = kNoIndex;  ///< first point of the block, or kNoIndex
};

/// Hash table of blocks, with open addressing. Blocks never move in memory. VoxelHashTable also
/// holds the keys, which would double the memory.
class BlockTable {
 public:
  const std::deque<MapBlock>& blocks() const { return blocks_; }

  /// The block of an index; adds a block without points. May throw std::bad_alloc.
  [[gnu::noinline]] MapBlock& find_or_add(const BlockIndex& index) {
    if (2 * blocks_.size() >= numbers_.size()) grow();
    std::uint32_t& number = numbers_[slot_of(index)];
    if (number == kNoIndex) {
      blocks_.push_back({index});
      number = static_cast<std::uint32_t>(blocks_.size() - 1);
    }
    return blocks_[number];
  }

  std::size_t memory_bytes() const {
    return blocks_.size() * sizeof(MapBlock) + numbers_.size() * sizeof(std::uint32_t);
  }

 private:
  // The slot of a block, or the empty slot where it would be added. At most half are in use.
  std::size_t slot_of(const BlockIndex& index) const {
    const auto hash = static_cast<std::uint32_t>(mixed_hash(index.x, index.y, index.z));
    std::size_t at = hash ^ (hash >> 13);  // the lower bits are well mixed
    for (;; ++at) {
      at &= numbers_.size() - 1;
      if (numbers_[at] == kNoIndex || blocks_[numbers_[at]].index == index) return at;
    }
  }

  void grow() {
    numbers_.assign(std::max<std::size_t>(1024, 2 * numbers_.size()), kNoIndex);
    std::uint32_t number = 0;
    for (const MapBlock& block : blocks_) numbers_[slot_of(block.index)] = number++;
  }

  std::deque<MapBlock> blocks_;         // in the order of their insertion
  std::vector<std::uint32_t> numbers_;  // by slot: index of a block, or kNoIndex
};

}  // namespace dynains::detail

namespace dynains {

/// Sparse voxel map. It stores the first measured point of each voxel, not the centre of the voxel.
///
/// Voxels are grouped in flat blocks of 8 x 4 x 2, because the ground is flat; the occupancy of a
/// block is one word. Points are stored in single precision relative to the corner of their block,
/// so their precision does not depend on the distance from the world origin. Points and blocks
/// never move in memory.
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
  // A copy would know the blocks of the original.
  StaticMapAccumulator(StaticMapAccumulator&&) = default;
  StaticMapAccumulator& operator=(StaticMapAccumulator&&) = default;

  const Config& config() const { return config_; }

  /// Adds points of one scan. `points`: m, sensor frame. `keep`: by point, 0 for points to ignore;
  /// an empty `keep` adds all points. A voxel with a point ignores further points.
  /// `T_world_sensor`: rigid, translation within kMaxTranslation. Throws std::length_error beyond
  /// 2^32 - 1 points, and std::bad_alloc.
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
      if (!keep.empty()) drop(keep.subspan(begin, count), batch);
      find_runs(count, batch);
      insert_runs(batch);
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
    return points_.size() * sizeof(Point) + blocks_.memory_bytes() +
           recent_.size() * sizeof(recent_[0]);
  }

  /// Calls `visit(Eigen::Vector3d)` for every point (m, world frame).
  template <class Visitor>
  void for_each(Visitor&& visit) const {
    for (const detail::MapBlock& block : blocks_.blocks()) {
      const Eigen::Vector3d corner(block.index.x * block_size(0), block.index.y * block_size(1),
                                   block.index.z * block_size(2));
      for (std::uint32_t i = block.first; i != kNoIndex; i = points_[i].next) {
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
  static constexpr std::int32_t kDropped = std::numeric_limits<std::int32_t>::min();
  struct Batch {
    alignas(64) float point[3][kBatch];         // m, relative to the corner of the block
    alignas(64) std::int32_t block[3][kBatch];  // indices in the world; the first may be kDropped
    alignas(64) std::int32_t voxel[kBatch];     // index in the block
    alignas(64) std::int32_t recent[kBatch];    // place of the block in recent_
    std::uint32_t run_end[kBatch];              // by run of points in one block
    std::size_t count;

    BlockIndex block_of(std::size_t i) const { return {block[0][i], block[1][i], block[2][i]}; }
    bool is_in(const BlockIndex& other, std::size_t i) const {
      return ((block[0][i] ^ other.x) | (block[1][i] ^ other.y) | (block[2][i] ^ other.z)) == 0;
    }
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

  // Drops the points without a `keep` flag, which are few.
  static void drop(Span<const std::uint8_t> keep, Batch& batch) {
    const std::uint8_t* at = keep.begin();
    const auto find = [&] { return std::memchr(at, 0, static_cast<std::size_t>(keep.end() - at)); };
    while ((at = static_cast<const std::uint8_t*>(find())) != nullptr) {
      batch.block[0][at++ - keep.begin()] = kDropped;
    }
  }

  // Finds the runs of points in one block, and prefetches their blocks.
  void find_runs(std::size_t count, Batch& batch) const {
    detail::with_packs([&](auto packs) {
      // Local copies: the compiler must assume that a store changes members.
      const auto* const known = recent_.data();
      const std::int32_t* const recent = batch.recent;
      std::uint32_t* next = batch.run_end;
      detail::for_each_run<decltype(packs)>(
          count,
          [&](std::size_t begin, std::size_t end) {
            __builtin_prefetch(known[recent[begin]]);
            *next++ = static_cast<std::uint32_t>(end);
          },
          batch.block[0], batch.block[1], batch.block[2]);
      batch.count = count;
    });
  }

  // Mostly, all voxels of a run have a point.
  [[gnu::noinline]] void insert_runs(const Batch& batch) {
    detail::MapBlock** const recent = recent_.data();
    const bool keep_all = keep_all_;
    std::size_t begin = 0;
    for (const std::uint32_t* end = batch.run_end; begin < batch.count; ++end) {
      const std::size_t first = begin;
      begin = *end;
      detail::MapBlock*& block = recent[batch.recent[first]];
      if (block == nullptr || !batch.is_in(block->index, first)) {
        if (batch.block[0][first] == kDropped) continue;
        block = &blocks_.find_or_add(batch.block_of(first));
      }
      const std::int32_t* voxel = batch.voxel + first;
      const std::int32_t* const last = batch.voxel + begin;
      std::uint64_t wanted = keep_all ? ~std::uint64_t{0} : ~block->occupied;
      do {
        if ((wanted >> *voxel & 1U) == 0) continue;
        add(batch, static_cast<std::size_t>(voxel - batch.voxel), *block);
        if (!keep_all) wanted = ~block->occupied;
      } while (++voxel != last);
    }
  }

  [[gnu::noinline]] void add(const Batch& batch, std::size_t i, detail::MapBlock& block) {
    if (points_.size() == kNoIndex) throw std::length_error("2^32 - 1 points are too many");
    points_.push_back({batch.point[0][i], batch.point[1][i], batch.point[2][i], block.first});
    block.first = static_cast<std::uint32_t>(points_.size() - 1);
    block.occupied |= std::uint64_t{1} << batch.voxel[i];
  }

  Config config_;
  double voxel_;
  bool keep_all_;
  detail::BlockTable blocks_;
  std::deque<Point> points_;
  std::vector<detail::MapBlock*> recent_;  // by cache slot: the last block, or null
};

}  // namespace dynains
