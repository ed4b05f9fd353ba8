// World coordinates and voxels of consecutive points of a scan.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>

#include "detail/voxel_grid.hpp"
#include "dynains/evaluation/scan.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::evaluation::detail {

/// Computes a block of points at a time, few enough for the fastest cache.
class LocatedPoints {
 public:
  LocatedPoints(const LabelledScan& scan, const VoxelGrid& grid)
      : scan_(scan), grid_(grid), T_world_sensor_(scan.T_world_sensor) {}

  /// Calls `visit(i, p_world, key)` for each point of the scan in order; `key` is kNoKey for a
  /// point that is not finite or outside of the grid. `prefetch(key)` is called some points before.
  template <class Prefetch, class Visit>
  void for_each(Prefetch&& prefetch, Visit&& visit) {
    for (std::size_t begin = 0; begin < scan_.size(); begin += kBlock) {
      const std::size_t count = std::min(kBlock, scan_.size() - begin);
      locate(begin, count);
      for (std::size_t k = 0; k < count; ++k) {
        prefetch(key_[std::min(k + kAhead, count - 1)]);
        visit(begin + k, Eigen::Vector3d(x_[k], y_[k], z_[k]), key_[k]);
      }
    }
  }

  /// World coordinates of one point: the same bits as for_each().
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
      // Local copies of members avoid reloads after stores that could alias them.
      const Transform transform = T_world_sensor_;
      const VoxelGrid grid = grid_;
      const std::size_t stride = scan_.stride;
      const float* const xyz = scan_.xyz + begin * stride;
      double* const x = x_.data();
      double* const y = y_.data();
      double* const z = z_.data();
      VoxelKey* const key = key_.data();
      for (std::size_t k = 0; k < count; ++k) {
        const double px = xyz[k * stride], py = xyz[k * stride + 1], pz = xyz[k * stride + 2];
        x[k] = transform.row(0, px, py, pz);
        y[k] = transform.row(1, px, py, pz);
        z[k] = transform.row(2, px, py, pz);
      }
      for (std::size_t k = 0; k < count; ++k) key[k] = grid.key(x[k], y[k], z[k]);
    });
  }

  const LabelledScan& scan_;
  const VoxelGrid& grid_;
  Transform T_world_sensor_;
  std::array<double, kBlock> x_, y_, z_;
  std::array<VoxelKey, kBlock> key_;
};

}  // namespace dynains::evaluation::detail
