// World coordinates and voxels of consecutive points of a scan.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "detail/range_gate.hpp"
#include "detail/voxel_grid.hpp"
#include "dynains/evaluation/scan.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::evaluation::detail {

/// Consecutive points of a scan in one voxel.
struct PointRun {
  VoxelKey key;
  std::size_t first;  ///< number of the first point in its scan
  std::size_t count;
  const double* x;  ///< world coordinates of the points, m
  const double* y;
  const double* z;

  Eigen::Vector3d p_world(std::size_t i) const { return {x[i], y[i], z[i]}; }
};

/// Computes a block of points at a time, few enough for the fastest cache.
class LocatedPoints {
 public:
  LocatedPoints(const LabelledScan& scan, const VoxelGrid& grid, const RangeGate& gate)
      : scan_(scan), grid_(grid), gate_(gate), T_world_sensor_(scan.T_world_sensor) {}

  /// Calls `visit(run)` for the runs of the scan in order, without points that do not pass the gate
  /// or lie outside of the grid. `prefetch(key)` is called some points before.
  template <class Prefetch, class Visit>
  void for_each_run(Prefetch&& prefetch, Visit&& visit) {
    for (std::size_t begin = 0; begin < scan_.size(); begin += kBlock) {
      const std::size_t count = std::min(kBlock, scan_.size() - begin);
      locate(begin, count);
      for (std::size_t k = 0; k < count;) {
        prefetch(key_[std::min(k + kAhead, count - 1)]);
        const VoxelKey key = key_[k];
        std::size_t end = k + 1;
        while (end < count && key_[end] == key) ++end;
        if (key != kNoKey) visit(PointRun{key, begin + k, end - k, &x_[k], &y_[k], &z_[k]});
        k = end;
      }
    }
  }

  /// World coordinates of one point: the same bits as for_each_run().
  Eigen::Vector3d p_world(std::size_t i) const {
    const Eigen::Vector3d p = scan_.point(i);
    const Transform& transform = T_world_sensor_;
    return {transform.row(0, p.x(), p.y(), p.z()), transform.row(1, p.x(), p.y(), p.z()),
            transform.row(2, p.x(), p.y(), p.z())};
  }

 private:
  static constexpr std::size_t kBlock = 512;
  static constexpr std::size_t kAhead = 12;

  /// The upper three rows of a pose.
  struct Transform {
    double of[3][4];

    explicit Transform(const Eigen::Isometry3d& T) {
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 4; ++j) of[i][j] = T(i, j);
      }
    }
    double row(int i, double x, double y, double z) const {
      return of[i][0] * x + of[i][1] * y + of[i][2] * z + of[i][3];
    }
  };

  void locate(std::size_t begin, std::size_t count) {
    dynains::detail::run_max_packs([&](auto) {
      // Local copies avoid reloads after stores that could alias the originals.
      const std::size_t size = count;
      const Transform transform = T_world_sensor_;
      const VoxelGrid grid = grid_;
      const RangeGate gate = gate_;
      const float* const xyz = scan_.xyz + begin * scan_.stride;
      double* const x = x_.data();
      double* const y = y_.data();
      double* const z = z_.data();
      VoxelKey* const key = key_.data();
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
  std::array<double, kBlock> x_, y_, z_;
  std::array<VoxelKey, kBlock> key_;
};

}  // namespace dynains::evaluation::detail
