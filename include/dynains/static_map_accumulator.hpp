// The static map (Eq. 1): measured points in the world frame, thinned to one point per voxel.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "dynains/map/chunked_vector.hpp"
#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/bits.hpp"
#include "dynains/simd/lanes.hpp"
#include "dynains/simd/pack_transform.hpp"
#include "dynains/simd/wide_lanes.hpp"

namespace dynains {

/// Sparse voxel map that keeps the first measured point of each voxel, never a voxel centre.
///
/// Voxels are grouped in blocks of 8 x 4 x 2, whose occupancy is one word: flat, as ground is, and
/// small, as far points are scattered. Blocks are found by linear hashing (Litwin, 1980): each new
/// block splits one bucket, so that the table never has to be built anew. Nor do stored points ever
/// move: growing makes no pause. Points are floats relative to their block, so that precision does
/// not depend on how far the world origin is.
class StaticMapAccumulator {
 public:
  struct Config {
    double map_voxel = 0.2;  ///< m, edge of a voxel; 0 keeps every point

    template <class Self, class Visitor>
    static void visit(Self& self, Visitor&& visitor) {
      visitor(Parameter{"map_voxel", self.map_voxel, closed(0, 10), "m",
                        "resolution of the static map, one measured point per voxel; 0 keeps all"});
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

  /// Adds the points of one scan (metres, sensor frame) whose `keep` flag is not zero; an empty
  /// `keep` adds all. Of several points in a voxel the first stays.
  void insert(PointsView points, Span<const std::uint8_t> keep,
              const Eigen::Isometry3d& T_world_sensor) {
    // Floats relative to a corner of blocks next to the sensor; whole blocks are exact.
    const double step = voxel_ * kBlockVoxels.maxCoeff();
    const Eigen::Vector3d corner = (T_world_sensor.translation() / step).array().floor();
    Eigen::Isometry3d T_corner_sensor = T_world_sensor;
    T_corner_sensor.translation() -= corner * step;
    const Eigen::Matrix<float, 3, 4> m = T_corner_sensor.matrix().topRows<3>().cast<float>();
    const auto blocks = [&](int axis) {
      return static_cast<std::int32_t>(corner[axis]) *
             (kBlockVoxels.maxCoeff() / kBlockVoxels[axis]);
    };
    const Index first = {blocks(0), blocks(1), blocks(2)};

    recent_.resize(kRecent, kEnd);
    Batch batch;
    for (std::size_t begin = 0; begin < points.size(); begin += kBatch) {
      const std::size_t count = std::min(kBatch, points.size() - begin);
      locate(points, begin, count, m, first, batch);
      choose(count, keep.empty() ? keep : keep.subspan(begin, count), batch);
      insert_chosen(batch);
    }
  }

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }

  /// Forgets all points and frees their memory.
  void clear() {
    buckets_ = {};
    blocks_ = {};
    points_ = {};
    recent_ = {};
    half_ = 1;
    size_ = 0;
    free_ = kEnd;
  }

  /// Bytes held by the map, its index included.
  std::size_t memory_bytes() const {
    return points_.memory_bytes() + blocks_.memory_bytes() + buckets_.memory_bytes() +
           recent_.size() * sizeof(recent_[0]);
  }

  /// Calls `visit(Eigen::Vector3d)` for every point, in metres, world frame.
  template <class Visitor>
  void for_each(Visitor&& visit) const {
    for (std::uint32_t b = 0; b < blocks_.size(); ++b) visit_block(b, visit);
  }

  /// Calls `visit(Eigen::Vector3d)` for every point inside `box` (world frame, borders included).
  /// Cost is that of the blocks which have room in the box, or of all blocks if these are fewer.
  template <class Visitor>
  void for_each_in(const Eigen::AlignedBox3d& box, Visitor&& visit) const {
    if (box.isEmpty()) return;
    const auto inside = [&](const Eigen::Vector3d& point) {
      if (box.contains(point)) visit(point);
    };
    // A place farther away has no block, and its number may not fit into one.
    constexpr double kFarthest = std::numeric_limits<std::int32_t>::max() - 1;
    // By the rounding of floats, a point may lie a little beside the block that has it.
    const Eigen::Array3d slack = 1e-3 * block_size();
    const Eigen::Array3d low = ((box.min().array() - slack) / block_size()).floor().max(-kFarthest);
    const Eigen::Array3d high = ((box.max().array() + slack) / block_size()).floor().min(kFarthest);
    if ((low > high).any()) return;
    const bool few = (high - low + 1.0).prod() < static_cast<double>(blocks_.size());
    if (!few) {
      for (std::uint32_t b = 0; b < blocks_.size(); ++b) {
        const Index& at = blocks_[b].at;
        const Eigen::Array3d place(at.x, at.y, at.z);
        if ((place >= low).all() && (place <= high).all()) visit_block(b, inside);
      }
      return;
    }
    const Eigen::Array3i first = low.cast<std::int32_t>();
    const Eigen::Array3i last = high.cast<std::int32_t>();
    for (std::int32_t x = first.x(); x <= last.x(); ++x) {
      for (std::int32_t y = first.y(); y <= last.y(); ++y) {
        for (std::int32_t z = first.z(); z <= last.z(); ++z) {
          const std::uint32_t found = find_block({x, y, z}, hash({x, y, z}));
          if (found != kEnd) visit_block(found, inside);
        }
      }
    }
  }

  /// Blocks of neighbouring voxels, numbered in the order in which their first points came.
  std::uint32_t block_count() const { return blocks_.size(); }
  /// The lowest corner of a block, in metres, world frame.
  Eigen::Vector3d block_corner(std::uint32_t block) const {
    const Index& at = blocks_[block].at;
    return Eigen::Array3d(at.x, at.y, at.z) * block_size();
  }
  /// Calls `visit(x, y, z)` for every point of a block, in metres from its corner.
  template <class Visitor>
  void visit_in_block(std::uint32_t block, Visitor&& visit) const {
    for (std::uint32_t i = blocks_[block].first; i != kEnd; i = points_[i].next) {
      visit(points_[i].x, points_[i].y, points_[i].z);
    }
  }
  /// Removes all points of a block; its voxels can be filled again.
  void erase_block(std::uint32_t block) {
    const std::uint32_t first = blocks_[block].first;
    if (first == kEnd) return;
    blocks_[block].occupied = 0;
    std::uint32_t* link = &blocks_[block].first;
    for (; *link != kEnd; link = &points_[*link].next) --size_;
    *link = free_;
    free_ = first;
    blocks_[block].first = kEnd;
  }

 private:
  static constexpr std::uint32_t kEnd = 0xFFFFFFFFU;
  static inline const Eigen::Array3i kBlockVoxels{8, 4, 2};

  struct Point {
    float x, y, z;       // m, relative to the corner of the block
    std::uint32_t next;  // in the block; kEnd behind the last
  };

  // Of a block in the world, counted in blocks.
  struct Index {
    std::int32_t x, y, z;
    friend bool operator==(const Index& a, const Index& b) {
      return ((a.x ^ b.x) | (a.y ^ b.y) | (a.z ^ b.z)) == 0;
    }
  };

  struct Block {
    std::uint64_t occupied;  // a bit per voxel
    Index at;
    std::uint32_t first;  // point
    std::uint32_t next;   // in the bucket; kEnd behind the last

    bool is_at(std::int32_t x, std::int32_t y, std::int32_t z) const {
      return at == Index{x, y, z};
    }
  };

  // The last block that was met in each of so many places, which repeat every 51.2 m (6.4 m in
  // height) at 0.2 m: neighbouring points meet the same few blocks again and again, and have them
  // without a walk through a bucket.
  static constexpr std::size_t kRecent = std::size_t{32} * 64 * 16;

  // Some points of a scan on their way into the map. Where their voxels are begins at number
  // kFirst, so that all have a predecessor.
  static constexpr std::size_t kBatch = 512;
  struct Batch {
    static constexpr std::size_t kFirst = detail::kMaxPackWidth;
    static constexpr std::size_t kRoom = kFirst + kBatch;
    alignas(64) float point[3][kBatch];        // m, relative to the corner of the block
    alignas(64) std::int32_t block[3][kRoom];  // in the world, counted in blocks
    alignas(64) std::int32_t voxel[kRoom];     // in its block
    alignas(64) std::int32_t recent[kBatch];   // place of the block among the recent ones
    std::uint32_t chosen[kRoom];               // numbers of points that may be added
    std::size_t chosen_count;
  };

  template <int kValue>
  using Constant = std::integral_constant<int, kValue>;

  Eigen::Array3d block_size() const { return voxel_ * kBlockVoxels.cast<double>(); }

  // Of `count` points from `begin` on. `corner`: the block in which the frame of `m` begins.
  void locate(PointsView scan, std::size_t begin, std::size_t count,
              const Eigen::Matrix<float, 3, 4>& m, const Index& corner, Batch& batch) const {
    using detail::PackConstant;
    const PackConstant scale(static_cast<float>(1.0 / voxel_));
    const Eigen::Array3f block_size = this->block_size().cast<float>();
    const PackConstant size[3] = {block_size.x(), block_size.y(), block_size.z()};
    alignas(64) std::int32_t first[3][detail::kMaxPackWidth];
    std::fill_n(first[0], detail::kMaxPackWidth, corner.x);
    std::fill_n(first[1], detail::kMaxPackWidth, corner.y);
    std::fill_n(first[2], detail::kMaxPackWidth, corner.z);
    const detail::PackTransform to_corner(m);
    const PointsView points = scan.subview(begin, count);
    detail::for_packs(count, [&](auto at) {
      using Float = typename decltype(at)::Float;
      using Int = typename decltype(at)::Int;
      const Float x = at.load(points.x.data());
      const Float y = at.load(points.y.data());
      const Float z = at.load(points.z.data());
      // What the next batch needs has to come from far away.
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
        block_in_world.store(&batch.block[axis][Batch::kFirst + at.begin]);
        voxel_in_block = (voxel_in_block << voxel_bits) + (voxel & Int((1 << voxel_bits) - 1));
        recent = (recent << recent_bits) + (block_in_world & Int((1 << recent_bits) - 1));
      };
      add_axis(Constant<2>(), Constant<1>(), Constant<4>());
      add_axis(Constant<1>(), Constant<2>(), Constant<6>());
      add_axis(Constant<0>(), Constant<3>(), Constant<5>());
      voxel_in_block.store(&batch.voxel[Batch::kFirst + at.begin]);
      recent.store(&batch.recent[at.begin]);
    });
  }

  // The points that are kept, but none in the voxel of a kept predecessor, as neighbours in a scan
  // often are; without a branch on single points.
  void choose(std::size_t count, Span<const std::uint8_t> keep, Batch& batch) const {
    constexpr std::size_t kBefore = Batch::kFirst - 1;
    batch.voxel[kBefore] = 0;
    for (auto& block : batch.block) block[kBefore] = 0;
    std::size_t chosen = 0;
    detail::run_max_packs([&](auto packs) {
      using Packs = decltype(packs);
      constexpr std::size_t kWord = 64;
      std::uint64_t was_kept = 0;
      for (std::size_t begin = 0; begin < count; begin += kWord) {
        const std::size_t size = std::min(kWord, count - begin);
        const std::uint64_t kept = keep.empty() ? ~std::uint64_t{0} >> (kWord - size)
                                                : detail::nonzero_bytes(keep.data() + begin, size);
        const std::size_t at = Batch::kFirst + begin;
        const std::uint64_t changes = detail::find_changes<Packs>(
            size, &batch.block[0][at], &batch.block[1][at], &batch.block[2][at], &batch.voxel[at]);
        const std::uint64_t repeats = keep_all_ ? 0 : ~changes & (kept << 1U | was_kept);
        was_kept = kept >> (kWord - 1);
        for (std::size_t i = 0; i < size; i += Packs::kCount) {
          const auto which = static_cast<unsigned>((kept & ~repeats) >> i & Packs::kAll);
          chosen += detail::put_places<Packs>(which, begin + i, &batch.chosen[chosen]);
        }
      }
    });
    batch.chosen_count = chosen;
  }

  void insert_chosen(const Batch& batch) {
    std::uint32_t* const recent = recent_.data();
    for (std::size_t k = 0; k < batch.chosen_count; ++k) {
      const std::uint32_t known = recent[batch.recent[batch.chosen[k]]];
      if (known < blocks_.size()) __builtin_prefetch(&blocks_[known]);
    }
    for (std::size_t k = 0; k < batch.chosen_count; ++k) {
      const std::size_t i = batch.chosen[k];
      const std::int32_t x = batch.block[0][Batch::kFirst + i];
      const std::int32_t y = batch.block[1][Batch::kFirst + i];
      const std::int32_t z = batch.block[2][Batch::kFirst + i];
      std::uint32_t& known = recent[batch.recent[i]];
      if (known >= blocks_.size() || !blocks_[known].is_at(x, y, z)) known = block_at({x, y, z});
      Block& block = blocks_[known];
      const std::uint64_t bit = std::uint64_t{1} << batch.voxel[Batch::kFirst + i];
      if ((block.occupied & bit) != 0 && !keep_all_) continue;
      block.first =
          add_point({batch.point[0][i], batch.point[1][i], batch.point[2][i], block.first});
      block.occupied |= bit;
    }
  }

  // In the place of one that was erased, if there is any.
  std::uint32_t add_point(const Point& point) {
    std::uint32_t place = free_;
    if (place == kEnd) {
      place = points_.push_back(point);
    } else {
      free_ = points_[place].next;
      points_[place] = point;
    }
    ++size_;
    return place;
  }

  std::uint32_t block_at(const Index& at) {
    const std::uint32_t h = hash(at);
    const std::uint32_t found = find_block(at, h);
    return found == kEnd ? add_block(at, h) : found;
  }

  static std::uint32_t hash(const Index& at) {
    std::uint32_t h = static_cast<std::uint32_t>(at.x) * 0x9E3779B1U ^
                      static_cast<std::uint32_t>(at.y) * 0x85EBCA77U ^
                      static_cast<std::uint32_t>(at.z) * 0xC2B2AE3DU;
    h ^= h >> 15;
    h *= 0x2C1B3C6DU;
    return h ^ (h >> 13);
  }

  // Buckets below `half_` have been there before this round; each split adds one behind them.
  std::uint32_t bucket_of(std::uint32_t hash) const {
    const std::uint32_t bucket = hash & (2 * half_ - 1);
    return bucket < buckets_.size() ? bucket : bucket - half_;
  }

  std::uint32_t find_block(const Index& at, std::uint32_t hash) const {
    if (buckets_.size() == 0) return kEnd;
    std::uint32_t b = buckets_[bucket_of(hash)];
    while (b != kEnd && !(blocks_[b].at == at)) b = blocks_[b].next;
    return b;
  }

  // As many buckets as blocks: on average, a block is found at the first or second look.
  std::uint32_t add_block(const Index& at, std::uint32_t hash) {
    split_bucket();
    std::uint32_t& first = buckets_[bucket_of(hash)];
    first = blocks_.push_back({0, at, kEnd, first});
    return first;
  }

  void split_bucket() {
    if (buckets_.size() == 2 * half_) half_ *= 2;
    const std::uint32_t added = buckets_.push_back(kEnd);
    if (added == 0) return;
    std::uint32_t* link = &buckets_[added - half_];
    std::uint32_t* moved = &buckets_[added];
    while (*link != kEnd) {
      Block& block = blocks_[*link];
      if (bucket_of(hash(block.at)) == added) {
        *moved = *link;
        *link = block.next;
        block.next = kEnd;
        moved = &block.next;
      } else {
        link = &block.next;
      }
    }
  }

  template <class Visitor>
  void visit_block(std::uint32_t block, Visitor&& visit) const {
    const Eigen::Vector3d corner = block_corner(block);
    visit_in_block(block, [&](float x, float y, float z) {
      const Eigen::Vector3d world = corner + Eigen::Vector3d(x, y, z);
      visit(world);
    });
  }

  Config config_;
  double voxel_;
  bool keep_all_;
  std::size_t size_ = 0;
  std::uint32_t half_ = 1;
  detail::ChunkedVector<std::uint32_t, 1024> buckets_;  // first block of each
  detail::ChunkedVector<Block, 512> blocks_;            // in the order of their first point
  detail::ChunkedVector<Point, 512> points_;
  std::uint32_t free_ = kEnd;          // first place of points that were erased
  std::vector<std::uint32_t> recent_;  // blocks, by the lowest bits of their coordinates
};

}  // namespace dynains
