// Removal of blocks of the static map that are free in later scans.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "dynains/belief/log_odds.hpp"
#include "dynains/evidence/free_space_config.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/voxels/block_table.hpp"

namespace dynains {

/// Sums the log-odds that a block of the map is free (see detail::FreeSpaceSum) over its visibility
/// from reference scans. Tests each block around the sensor once per period, against the newest
/// reference scan. The cost depends on the density of the map around the sensor, not on the size of
/// the map. Goes beyond the paper.
class MapRevision {
 public:
  using Config = MapRevisionConfig;

  MapRevision() : MapRevision(Config()) {}

  /// Throws ConfigError.
  explicit MapRevision(const Config& config)
      : config_((config.validate(), config)),
        sum_(config.revision_free, config.revision_hit),
        level_(static_cast<float>(log_odds(config.tau_revise))) {}

  const Config& config() const { return config_; }

  /// Tests the blocks that are due at scan number `scan`, and erases free blocks from `map`.
  /// `sensor_world`: position of the sensor, m, world frame. `test_visibility(points, count,
  /// T_world_points)`: calls FreeSpaceEvidence::test_visibility().
  template <class Map, class TestVisibility>
  void revise(Map& map, std::uint64_t scan, const Eigen::Vector3d& sensor_world,
              TestVisibility&& test_visibility) {
    add_new_blocks(map);
    gather(map, scan, sensor_world);
    if (blocks_.empty()) return;
    const auto& visibility =
        test_visibility(samples_, begin_.back(), Pose(Eigen::Translation3d(sensor_world)));
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      const auto count = visibility.count(begin_[i], begin_[i + 1]);
      float& level = levels_[blocks_[i]];
      update(count.free, count.hit, begin_[i + 1] - begin_[i], level);
      if (level < level_) continue;
      map.erase_block(blocks_[i]);
      level = 0.0F;
    }
  }

  /// Forgets all blocks.
  void clear() {
    tiles_.clear();
    levels_ = {};
  }

 private:
  static constexpr double kTile = 25.0;             // m
  static constexpr std::uint32_t kMostSamples = 8;  // per block

  static std::int64_t tile_of(double metres) {
    return static_cast<std::int64_t>(std::floor(metres / kTile));
  }
  static std::uint64_t key(std::int64_t x, std::int64_t y) {
    return static_cast<std::uint64_t>(x) << 32U ^ (static_cast<std::uint64_t>(y) & 0xFFFFFFFFU);
  }

  template <class Map>
  void add_new_blocks(const Map& map) {
    for (std::uint32_t b = levels_.size(); b < map.block_count(); ++b) {
      const Eigen::Vector3d corner = map.block_corner(b);
      tiles_[key(tile_of(corner.x()), tile_of(corner.y()))].push_back(b);
      levels_.push_back(0.0F);
    }
  }

  // Collects samples of the blocks that are due: m, relative to the sensor, with the axes of the
  // world frame.
  template <class Map>
  void gather(const Map& map, std::uint64_t scan, const Eigen::Vector3d& sensor_world) {
    blocks_.clear();
    begin_.assign(1, 0);
    const double range = config_.revision_range;
    const std::int64_t last_x = tile_of(sensor_world.x() + range);
    const std::int64_t last_y = tile_of(sensor_world.y() + range);
    const auto period = static_cast<std::uint64_t>(config_.revision_period);
    for (std::int64_t x = tile_of(sensor_world.x() - range); x <= last_x; ++x) {
      for (std::int64_t y = tile_of(sensor_world.y() - range); y <= last_y; ++y) {
        const auto found = tiles_.find(key(x, y));
        if (found == tiles_.end()) continue;
        const std::vector<std::uint32_t>& tile = found->second;
        for (std::size_t i = (scan + key(x, y)) % period; i < tile.size(); i += period) {
          gather_block(map, tile[i], sensor_world);
        }
      }
    }
  }

  template <class Map>
  void gather_block(const Map& map, std::uint32_t block, const Eigen::Vector3d& sensor_world) {
    const Eigen::Vector3d corner = map.block_corner(block) - sensor_world;
    if (corner.head<2>().norm() > config_.revision_range) return;
    std::uint32_t count = begin_.back();
    const std::uint32_t most = count + kMostSamples;
    samples_.grow(most + detail::kPackWidth);
    map.visit_in_block(block, [&](float x, float y, float z) {
      if (count == most) return;
      samples_.x[count] = static_cast<float>(corner.x()) + x;
      samples_.y[count] = static_cast<float>(corner.y()) + y;
      samples_.z[count] = static_cast<float>(corner.z()) + z;
      ++count;
    });
    if (count == begin_.back()) return;
    blocks_.push_back(block);
    begin_.push_back(count);
  }

  void update(std::uint32_t free, std::uint32_t hit, std::uint32_t samples, float& level) const {
    const std::optional<float> ratio = detail::FreeSpaceSum::free_ratio(free, hit, samples);
    if (!ratio) return;
    if (*ratio >= detail::FreeSpaceSum::kFreeRatio) sum_.raise(level, *ratio);
    if (*ratio <= detail::FreeSpaceSum::kHitRatio) sum_.lower(level);
  }

  Config config_;
  detail::FreeSpaceSum sum_;
  float level_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> tiles_;  // blocks by tile key
  detail::ChunkedVector<float, 1024> levels_;  // by block: log-odds that it is free
  std::vector<std::uint32_t> blocks_;          // tested blocks
  std::vector<std::uint32_t> begin_;           // by tested block: first sample, and the end
  PointBuffer samples_;
};

}  // namespace dynains
