// The surfaces around the sensor, as far as earlier scans have measured them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains::odometry {

/// Voxel of a point in a grid of this edge (m).
VoxelKey voxel_of(const Eigen::Vector3d& point, double edge);

/// A plane, an upright pole, or clutter: directions in which it tells where a point is.
struct Surface {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();  ///< m
  std::array<Eigen::Vector3d, 2> directions;       ///< unit vectors
  std::size_t direction_count = 0;                 ///< 1: plane, 2: pole or clutter, 0: nothing
  double variance = 0.0;                           ///< m^2, of clutter across its longest extent
};

/// Points in a hash table of voxels, no two of one voxel nearer than a spacing.
class PointGrid {
 public:
  /// `edge`: m, of the voxels, and the radius within which neighbours are found.
  PointGrid(double edge, double spacing) : edge_(edge), squared_spacing_(spacing * spacing) {}

  bool empty() const { return voxels_.empty(); }
  void insert(const Eigen::Vector3d& point);
  void forget_beyond(const Eigen::Vector3d& centre, double reach);
  /// The surface through the nearest points.
  Surface surface_at(const Eigen::Vector3d& point, const Eigen::Vector3d& up) const;

 private:
  static constexpr std::size_t kMost = 24;        // points of a voxel
  static constexpr std::size_t kNeighbours = 10;  // of a surface

  struct Voxel {
    VoxelKey key;
    std::uint32_t count = 0;
    std::array<Eigen::Vector3d, kMost> points;
  };
  struct Neighbours {
    std::array<double, kNeighbours> squared;
    std::array<const Eigen::Vector3d*, kNeighbours> points;
    std::size_t count = 0;

    void add(const Eigen::Vector3d& point, double squared_distance);
    /// Squared distance from which a point does not count.
    double reach(double most) const { return count < kNeighbours ? most : squared[count - 1]; }
  };

  Neighbours neighbours_of(const Eigen::Vector3d& point) const;

  double edge_;
  double squared_spacing_;
  VoxelHashTable<> numbers_;
  std::vector<Voxel> voxels_;
};

/// Points of earlier scans in two grids: the coarse one has surfaces where the beams of the sensor
/// are too far apart for the fine one.
class LocalMap {
 public:
  bool empty() const { return fine_.empty(); }

  void insert(const Eigen::Vector3d& point) {
    fine_.insert(point);
    coarse_.insert(point);
  }
  /// Forgets what is farther than `reach` m from `centre`.
  void forget_beyond(const Eigen::Vector3d& centre, double reach) {
    fine_.forget_beyond(centre, reach);
    coarse_.forget_beyond(centre, reach);
  }

  /// The surface at a point. `up`: unit vector; lines along other directions are the rings of a
  /// sensor, which move with it.
  Surface surface_at(const Eigen::Vector3d& point, const Eigen::Vector3d& up) const {
    const Surface fine = fine_.surface_at(point, up);
    if (fine.direction_count == 1 || fine.direction_count == 2) return fine;
    const Surface coarse = coarse_.surface_at(point, up);
    return coarse.direction_count == 1 || coarse.direction_count == 2 ? coarse : fine;
  }

 private:
  PointGrid fine_{1.0, 0.2};
  PointGrid coarse_{3.0, 0.6};
};

}  // namespace dynains::odometry
