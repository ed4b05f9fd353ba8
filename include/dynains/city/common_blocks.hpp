// Common samples of the points of several sessions.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/city/session_grid.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/bits.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::detail {

/// Blocks of 2 x 2 x 2 voxels of a tile with common samples: of each voxel, the point of the first
/// session that has one. Sessions whose points fill the same voxels of a block have one shape
/// there, and the samples of a shape are tested once for all of them. So the cost of a reference
/// grows with the voxels of the tile, not with the number of sessions.
class CommonBlocks {
 public:
  /// References of one session that decided on a shape.
  struct Evidence {
    std::uint32_t free = 0, hit = 0;
    std::uint32_t free_scan = 0;  ///< latest reference that passed
  };

  /// Adds a point, in the order of the sessions. Returns its block.
  std::uint32_t add(const VoxelKey& block_key, std::uint32_t octant, const SessionPoint& point) {
    const std::uint32_t number = block_numbers_.insert(block_key);
    if (number == blocks_.size()) {
      blocks_.emplace_back();
      blocks_.back().first_octant = octant;
    }
    Block& block = blocks_[number];
    const auto bit = static_cast<std::uint8_t>(1U << octant);
    if ((block.filled & bit) == 0) {
      block.filled = static_cast<std::uint8_t>(block.filled | bit);
      block.samples[octant] = {point.x, point.y, point.z};
    }
    return number;
  }

  /// Number of the shape of a block whose points fill the octants of `filled`.
  std::uint32_t shape(std::uint32_t block, std::uint8_t filled) {
    const std::uint32_t number = shape_numbers_.insert(VoxelKey{block} << 8U | filled);
    if (number == shapes_.size()) {
      shapes_.push_back({filled, 0, false, blocks_[block].first_shape, {}});
      blocks_[block].first_shape = number;
    }
    return number;
  }

  /// Forgets all evidence, and which shapes are tested.
  void clear() {
    for (Block& block : blocks_) block.tested = 0;
    for (Shape& shape : shapes_) {
      shape.is_tested = false;
      shape.evidence = {};
    }
  }
  /// Has a shape of a block tested by the references that follow.
  void enable(std::uint32_t block, std::uint32_t shape) {
    blocks_[block].tested =
        static_cast<std::uint8_t>(blocks_[block].tested | shapes_[shape].filled);
    shapes_[shape].is_tested = true;
  }
  /// To be called when all shapes are enabled.
  void finish() {
    for (const Block& block : blocks_) {
      for_each_tested(block, [&](Shape& shape) {
        shape.places = 0;
        std::uint32_t place = 0;
        for (std::uint32_t octant = 0; octant < 8; ++octant) {
          if ((block.tested >> octant & 1U) == 0) continue;
          shape.places =
              static_cast<std::uint8_t>(shape.places | (shape.filled >> octant & 1U) << place++);
        }
      });
    }
  }

  const Evidence& evidence(std::uint32_t shape) const { return shapes_[shape].evidence; }

  /// Tests the enabled shapes whose blocks are within `range` (m) of `sensor` (m, in the frame of
  /// the points; distances in the plane). `test_visibility`: see TileHistory::revise().
  /// `judge(free, hit, samples)`: 1 if so many free and hit samples tell that a block is free, -1
  /// if it is hit, else 0.
  template <class TestVisibility, class Judge>
  void test(std::uint32_t scan, const Eigen::Vector3d& sensor, double range,
            TestVisibility&& test_visibility, Judge&& judge) {
    gather(sensor, range);
    if (tested_.empty()) return;
    const auto& visibility = test_visibility(samples_, std::size_t{begin_.back()});
    for (std::size_t i = 0; i < tested_.size(); ++i) {
      const auto [free, hit] = visibility.bits(begin_[i], begin_[i + 1]);
      for_each_tested(blocks_[tested_[i]], [&, free = free, hit = hit](Shape& shape) {
        const int verdict = judge(count_ones(free & shape.places), count_ones(hit & shape.places),
                                  count_ones(shape.places));
        if (verdict > 0) {
          ++shape.evidence.free;
          shape.evidence.free_scan = scan;
        } else if (verdict < 0) {
          ++shape.evidence.hit;
        }
      });
    }
  }

 private:
  static constexpr std::uint32_t kNone = VoxelHashTable<>::kNone;

  struct Block {
    std::array<std::array<float, 3>, 8> samples;  // m, by octant
    std::uint8_t filled = 0;                      // octants that have a sample
    std::uint8_t tested = 0;                      // octants of enabled shapes
    std::uint32_t first_octant = 0;               // of the first sample
    std::uint32_t first_shape = kNone;
  };
  struct Shape {
    std::uint8_t filled;  // octants
    std::uint8_t places;  // of these octants among the tested ones of the block
    bool is_tested;
    std::uint32_t next;  // shape of the block
    Evidence evidence;
  };

  template <class Visitor>
  void for_each_tested(const Block& block, Visitor&& visit) {
    for (std::uint32_t i = block.first_shape; i != kNone; i = shapes_[i].next) {
      if (shapes_[i].is_tested) visit(shapes_[i]);
    }
  }

  void gather(const Eigen::Vector3d& sensor, double range) {
    tested_.clear();
    begin_.assign(1, 0);
    for (std::uint32_t i = 0; i < blocks_.size(); ++i) {
      const Block& block = blocks_[i];
      if (block.tested == 0) continue;
      const std::array<float, 3>& first = block.samples[block.first_octant];
      const double dx = static_cast<double>(first[0]) - sensor.x();
      const double dy = static_cast<double>(first[1]) - sensor.y();
      if (dx * dx + dy * dy > range * range) continue;
      std::uint32_t count = begin_.back();
      samples_.grow(count + 8 + kPackWidth);
      for_each_bit(block.tested, [&](std::size_t octant) {
        const std::array<float, 3>& sample = block.samples[octant];
        samples_.x[count] = static_cast<float>(static_cast<double>(sample[0]) - sensor.x());
        samples_.y[count] = static_cast<float>(static_cast<double>(sample[1]) - sensor.y());
        samples_.z[count] = static_cast<float>(static_cast<double>(sample[2]) - sensor.z());
        ++count;
      });
      tested_.push_back(i);
      begin_.push_back(count);
    }
  }

  VoxelHashTable<> block_numbers_;
  std::vector<Block> blocks_;
  VoxelHashTable<> shape_numbers_;  // by block and filled octants
  std::vector<Shape> shapes_;
  std::vector<std::uint32_t> tested_;  // blocks
  std::vector<std::uint32_t> begin_;   // by tested block: first sample, and the end
  PointBuffer samples_;
};

}  // namespace dynains::detail
