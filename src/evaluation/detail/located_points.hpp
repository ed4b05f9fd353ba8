// World coordinates and voxels of consecutive points of a scan.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "dynains/evaluation/scan.hpp"
#include "dynains/pose.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "evaluation/detail/range_gate.hpp"
#include "evaluation/detail/voxel_grid.hpp"

namespace dynains::evaluation::detail {

/// Consecutive points of a scan.
struct PointBlock {
  static constexpr std::size_t kMost = 512;  // few enough for the fastest cache

  std::size_t first;  ///< number of the first point in its scan
  std::size_t count;
  std::array<double, kMost> x, y, z;  ///< world coordinates, m
  std::array<VoxelKey, kMost> key;    ///< kNoKey: does not pass the gate, or outside of the grid

  Eigen::Vector3d p_world(std::size_t i) const { return {x[i], y[i], z[i]}; }
};

/// Computes a block of points at a time.
class LocatedPoints {
 public:
  LocatedPoints(const LabelledScan& scan, const VoxelGrid& grid, const RangeGate& gate)
      : scan_(scan), grid_(grid), gate_(gate), T_world_sensor_(scan.T_world_sensor) {}

  /// Calls `visit(PointBlock&)` for the blocks of the scan in order.
  template <class Visit>
  void for_each_block(Visit&& visit) {
    PointBlock block;
    for (std::size_t begin = 0; begin < scan_.size(); begin += PointBlock::kMost) {
      block.first = begin;
      block.count = std::min(PointBlock::kMost, scan_.size() - begin);
      locate(block);
      visit(block);
    }
  }

  /// World coordinates of one point: the same bits as in its block.
  Eigen::Vector3d p_world(std::size_t i) const {
    const Eigen::Vector3d p = scan_.point(i);
    const Transform& transform = T_world_sensor_;
    return {transform.row(0, p.x(), p.y(), p.z()), transform.row(1, p.x(), p.y(), p.z()),
            transform.row(2, p.x(), p.y(), p.z())};
  }

 private:
  /// The upper three rows of a pose.
  struct Transform {
    double of[3][4];

    explicit Transform(const Pose& T) {
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 4; ++j) of[i][j] = T(i, j);
      }
    }
    double row(int i, double x, double y, double z) const {
      return of[i][0] * x + of[i][1] * y + of[i][2] * z + of[i][3];
    }
  };

  void locate(PointBlock& block) {
    dynains::detail::with_packs([&](auto) {
      // Local copies avoid reloads after stores that could alias the originals.
      const std::size_t size = block.count;
      const Transform transform = T_world_sensor_;
      const VoxelGrid grid = grid_;
      const RangeGate gate = gate_;
      const float* const xyz = scan_.xyz + block.first * scan_.stride;
      double* const x = block.x.data();
      double* const y = block.y.data();
      double* const z = block.z.data();
      VoxelKey* const key = block.key.data();
      const auto transform_all = [=](std::size_t stride) {
        for (std::size_t k = 0; k < size; ++k) {
          const float* const p = xyz + k * stride;
          const double px = p[0], py = p[1], pz = p[2];
          x[k] = transform.row(0, px, py, pz);
          y[k] = transform.row(1, px, py, pz);
          z[k] = transform.row(2, px, py, pz);
          key[k] = static_cast<VoxelKey>(static_cast<std::int64_t>(gate.passes(px, py, pz)) - 1);
        }
      };
      // A constant stride makes faster loads.
      if (scan_.stride == 4) {
        transform_all(4);
      } else {
        transform_all(scan_.stride);
      }
      for (std::size_t k = 0; k < size; ++k) key[k] |= grid.key(x[k], y[k], z[k]);
    });
  }

  const LabelledScan& scan_;
  const VoxelGrid& grid_;
  const RangeGate& gate_;
  Transform T_world_sensor_;
};

}  // namespace dynains::evaluation::detail
