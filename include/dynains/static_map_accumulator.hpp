// The static map (Eq. 1): measured points in the world frame, thinned to one point per voxel.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "dynains/detail/lanes.hpp"
#include "dynains/parameters.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// Sparse voxel map that keeps the first measured point of each voxel, never a voxel centre.
///
/// Voxels are grouped in blocks of 8^3 whose occupancy is one cache line, blocks in tiles of 8^3.
/// Points are floats relative to their block, so that precision does not depend on how far the
/// world origin is. Growing never moves stored points: there is no pause.
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
    // Floats relative to the corner of a block next to the sensor; whole blocks are exact.
    const double block_size = voxel_ * kBlockEdge;
    const Eigen::Vector3d corner = (T_world_sensor.translation() / block_size).array().floor();
    Eigen::Isometry3d T_corner_sensor = T_world_sensor;
    T_corner_sensor.translation() -= corner * block_size;
    const Eigen::Matrix<float, 3, 4> m = T_corner_sensor.matrix().topRows<3>().cast<float>();
    Cursor cursor;
    cursor.corner = corner.cast<std::int32_t>();

    constexpr std::size_t kBatch = detail::kLanes;
    float local[3][kBatch];
    std::int32_t voxel[3][kBatch];
    for (std::size_t i = 0; i < points.size(); i += kBatch) {
      const std::size_t lanes = std::min(kBatch, points.size() - i);
      locate(points, i, lanes, m, local, voxel);
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        if (!keep.empty() && keep[i + lane] == 0) continue;
        insert_point(cursor, {voxel[0][lane], voxel[1][lane], voxel[2][lane]},
                     {local[0][lane], local[1][lane], local[2][lane]});
      }
    }
  }

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }

  /// Forgets all points and frees their memory.
  void clear() {
    tiles_.clear();
    tile_of_.clear();
    size_ = 0;
    block_count_ = 0;
    chunk_count_ = 0;
  }

  /// Bytes held by the map, its index included.
  std::size_t memory_bytes() const {
    return tiles_.size() * (sizeof(Tile) + kTileOverhead) + block_bytes() + chunk_bytes();
  }

  /// Calls `visit(Eigen::Vector3d)` for every point, in metres, world frame.
  template <class Visitor>
  void for_each(Visitor&& visit) const {
    for (const auto& tile : tiles_) visit_tile(*tile, visit);
  }

  /// Calls `visit(Eigen::Vector3d)` for every point inside `box` (world frame, borders included).
  /// Cost is that of the tiles which the box touches.
  template <class Visitor>
  void for_each_in(const Eigen::AlignedBox3d& box, Visitor&& visit) const {
    if (box.isEmpty()) return;
    const auto inside = [&](const Eigen::Vector3d& point) {
      if (box.contains(point)) visit(point);
    };
    const double tile_size = voxel_ * kBlockEdge * kTileEdge;
    const Eigen::Array3d low = (box.min() / tile_size).array().floor();
    const Eigen::Array3d high = (box.max() / tile_size).array().floor();
    const bool few = (high - low + 1.0).prod() < static_cast<double>(tiles_.size());
    if (!few) {
      for (const auto& tile : tiles_) {
        const Eigen::Array3d at = tile->key.cast<double>().array();
        if ((at >= low).all() && (at <= high).all()) visit_tile(*tile, inside);
      }
      return;
    }
    const Eigen::Vector3i first = low.matrix().cast<std::int32_t>();
    const Eigen::Vector3i last = high.matrix().cast<std::int32_t>();
    for (std::int32_t x = first.x(); x <= last.x(); ++x) {
      for (std::int32_t y = first.y(); y <= last.y(); ++y) {
        for (std::int32_t z = first.z(); z <= last.z(); ++z) {
          const auto found = tile_of_.find({x, y, z});
          if (found != tile_of_.end()) visit_tile(*tiles_[found->second], inside);
        }
      }
    }
  }

 private:
  static constexpr std::int32_t kBlockEdge = 8;  // voxels
  static constexpr std::int32_t kTileEdge = 8;   // blocks
  static constexpr std::size_t kTileOverhead = 64;

  struct Point {
    float x, y, z;       // m, relative to the corner of the block
    std::uint32_t next;  // in the tile; kEnd behind the last
  };
  static constexpr std::uint32_t kEnd = 0xFFFFFFFFU;

  struct Block {
    std::array<std::uint64_t, kBlockEdge> occupied{};  // a slice of constant z each
    std::uint32_t first = kEnd;
    std::uint32_t index = 0;  // place in the tile
  };

  // Grows by whole chunks that never move.
  template <class T, std::size_t kChunk>
  struct ChunkedVector {
    std::vector<std::unique_ptr<T[]>> chunks;
    std::uint32_t size = 0;
    T& operator[](std::uint32_t i) { return chunks[i / kChunk][i % kChunk]; }
    const T& operator[](std::uint32_t i) const { return chunks[i / kChunk][i % kChunk]; }
    // True if a chunk was added.
    bool grow() {
      const bool full = size++ == chunks.size() * kChunk;
      if (full) chunks.push_back(std::make_unique<T[]>(kChunk));
      return full;
    }
  };
  static constexpr std::size_t kPointChunk = 64;
  static constexpr std::size_t kBlockChunk = 8;

  struct Tile {
    explicit Tile(const Eigen::Vector3i& at) : key(at) {}

    Eigen::Vector3i key;
    std::array<std::uint16_t, kTileEdge * kTileEdge * kTileEdge> block_of{};  // 0 = none, else + 1
    ChunkedVector<Block, kBlockChunk> blocks;
    ChunkedVector<Point, kPointChunk> points;
  };

  struct KeyHash {
    std::size_t operator()(const Eigen::Vector3i& key) const {
      std::uint64_t h = static_cast<std::uint32_t>(key.x());
      h = h * 0x9E3779B97F4A7C15ULL + static_cast<std::uint32_t>(key.y());
      h = h * 0x9E3779B97F4A7C15ULL + static_cast<std::uint32_t>(key.z());
      h *= 0x9E3779B97F4A7C15ULL;
      return static_cast<std::size_t>(h ^ (h >> 32));
    }
  };

  // Neighbouring points of a scan mostly fall into the same tile.
  struct Cursor {
    Eigen::Vector3i corner;  // block at the origin of the local frame
    Eigen::Vector3i key = Eigen::Vector3i::Zero();
    Tile* tile = nullptr;
  };

  std::size_t block_bytes() const { return block_count_ * kBlockChunk * sizeof(Block); }
  std::size_t chunk_bytes() const { return chunk_count_ * kPointChunk * sizeof(Point); }

  // Points in the local frame, and their voxels there.
  void locate(PointsView points, std::size_t begin, std::size_t lanes,
              const Eigen::Matrix<float, 3, 4>& m, float (&local)[3][detail::kLanes],
              std::int32_t (&voxel)[3][detail::kLanes]) const {
    using detail::Float8;
    float p[3][detail::kLanes] = {};
    std::copy_n(points.x.begin() + begin, lanes, p[0]);
    std::copy_n(points.y.begin() + begin, lanes, p[1]);
    std::copy_n(points.z.begin() + begin, lanes, p[2]);
    const Float8 x = Float8::load(p[0]);
    const Float8 y = Float8::load(p[1]);
    const Float8 z = Float8::load(p[2]);
    const Float8 scale(static_cast<float>(1.0 / voxel_));
    for (int row = 0; row < 3; ++row) {
      const Float8 value = (Float8(m(row, 0)) * x + Float8(m(row, 1)) * y) +
                           (Float8(m(row, 2)) * z + Float8(m(row, 3)));
      value.store(local[row]);
      const Float8 scaled = value * scale;
      const detail::Int8 whole = truncate(scaled);
      const detail::Mask8 above = to_float(whole) > scaled;  // truncated upwards: negative
      (whole - select(above, detail::Int8(1), detail::Int8(0))).store(voxel[row]);
    }
  }

  Tile& tile_at(Cursor& cursor, const Eigen::Vector3i& key) {
    if (cursor.tile == nullptr || key != cursor.key) {
      const auto [found, added] = tile_of_.try_emplace(key, tiles_.size());
      if (added) tiles_.push_back(std::make_unique<Tile>(key));
      cursor.tile = tiles_[found->second].get();
      cursor.key = key;
    }
    return *cursor.tile;
  }

  void insert_point(Cursor& cursor, const Eigen::Vector3i& voxel, const Eigen::Vector3f& local) {
    // Arithmetic shifts and masks are floor division and remainder by 8.
    const Eigen::Vector3i local_block(voxel.x() >> 3, voxel.y() >> 3, voxel.z() >> 3);
    const Eigen::Vector3i block_key = local_block + cursor.corner;
    Tile& tile =
        tile_at(cursor, {block_key.x() >> 3, block_key.y() >> 3, block_key.z() >> 3});
    const auto place = static_cast<std::size_t>(
        ((block_key.z() & 7) * kTileEdge + (block_key.y() & 7)) * kTileEdge + (block_key.x() & 7));
    std::uint16_t& block_number = tile.block_of[place];
    if (block_number == 0) {
      if (tile.blocks.grow()) ++block_count_;
      block_number = static_cast<std::uint16_t>(tile.blocks.size);
      tile.blocks[tile.blocks.size - 1].index = static_cast<std::uint32_t>(place);
    }
    Block& block = tile.blocks[block_number - 1U];
    const std::uint64_t bit = std::uint64_t{1} << ((voxel.y() & 7) * kBlockEdge + (voxel.x() & 7));
    std::uint64_t& slice = block.occupied[static_cast<std::size_t>(voxel.z() & 7)];
    if ((slice & bit) != 0 && !keep_all_) return;
    slice |= bit;
    if (tile.points.grow()) ++chunk_count_;
    const std::uint32_t number = tile.points.size - 1;
    const auto block_size = static_cast<float>(voxel_ * kBlockEdge);
    const Eigen::Vector3f offset = local - local_block.cast<float>() * block_size;
    tile.points[number] = {offset.x(), offset.y(), offset.z(), block.first};
    block.first = number;
    ++size_;
  }

  template <class Visitor>
  void visit_tile(const Tile& tile, Visitor&& visit) const {
    const double block_size = voxel_ * kBlockEdge;
    for (std::uint32_t b = 0; b < tile.blocks.size; ++b) {
      const Block& block = tile.blocks[b];
      const auto place = static_cast<std::int32_t>(block.index);
      const Eigen::Vector3i block_key =
          tile.key * kTileEdge + Eigen::Vector3i(place & 7, (place >> 3) & 7, place >> 6);
      const Eigen::Vector3d corner = block_key.cast<double>() * block_size;
      for (std::uint32_t i = block.first; i != kEnd; i = tile.points[i].next) {
        const Point& point = tile.points[i];
        const Eigen::Vector3d world = corner + Eigen::Vector3d(point.x, point.y, point.z);
        visit(world);
      }
    }
  }

  Config config_;
  double voxel_;
  bool keep_all_;
  std::size_t size_ = 0;
  std::size_t block_count_ = 0;  // chunks of blocks
  std::size_t chunk_count_ = 0;  // chunks of points
  std::vector<std::unique_ptr<Tile>> tiles_;  // in the order of their first point
  std::unordered_map<Eigen::Vector3i, std::size_t, KeyHash> tile_of_;
};

}  // namespace dynains
