// Planes, upright poles and clutter in the cells of grids.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <vector>

#include "dynains/pose.hpp"
#include "dynains/sensor/plane_fit.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// Edges of the cells (m) by level, from coarse to fine.
inline constexpr std::size_t kCellLevels = 3;
inline constexpr std::array<double, kCellLevels> kCellEdges = {4.0, 2.0, 1.0};

/// Deviation (m) of the distance of a point to its surface. Distances of neighbouring points are
/// correlated, so it is a large value.
inline constexpr double kPointDeviation = 0.2;
/// Nearer points (m) belong to the own vehicle.
inline constexpr double kMinPoint = 2.0;

/// Whether `key` was new to `table`, which has it now.
inline bool adds(VoxelHashTable<>& table, VoxelKey key) {
  const std::size_t count = table.size();
  return table.insert(key) == count;
}

/// Plane, upright pole or clutter through the points of a cell.
struct CellSurface {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();  ///< m
  std::array<Eigen::Vector3d, 2> directions;       ///< orthonormal; it determines places along them
  std::size_t direction_count = 0;                 ///< 0: nothing, 1: plane, 2: pole or clutter
  double variance = 0.0;                           ///< m^2, of clutter across its longest extent
  bool is_upright = false;                         ///< a pole or wall

  /// m^2, of a point (m) along the directions.
  double squared_distance(const Eigen::Vector3d& point) const {
    double squared = 0.0;
    for (std::size_t k = 0; k < direction_count; ++k) {
      const double distance = directions[k].dot(point - mean);
      squared += distance * distance;
    }
    return squared;
  }
};

/// Surfaces through points, of one scan or of a map that grows, in the cells of a grid for each
/// level. One thread at a time.
class SurfaceGrid {
 public:
  /// `with_clutter`: whether clutter counts, and larger cells where a cell has no surface. In one
  /// scan clutter is persons and noise; in a map of many scans it also shows where a scan is.
  /// `scale`: ratio of the edges of cells and kCellEdges; less in rooms that are narrower.
  explicit SurfaceGrid(bool with_clutter = false, double scale = 1.0)
      : with_clutter_(with_clutter), scale_(scale) {}

  bool empty() const { return levels_.back().cells.empty(); }
  /// Distance (m) at which a turn moves points as far as is usual in the scene.
  double lever() const { return scale_ * detail::kLever; }
  /// Least eigenvalue of normal equations whose direction is determined, in points whose distance
  /// changes as much as the motion. Clutter determines every direction a little.
  double min_determined() const { return with_clutter_ ? 2.0 : 0.01; }
  /// The next points are of a scan by a sensor at this place (m).
  void begin_scan(const Eigen::Vector3d& sensor) { sensor_ = sensor; }
  /// Adds a point (m). Dense rings would outweigh others: of a small voxel, one point counts.
  void insert(const Eigen::Vector3d& point);
  /// Forgets what is farther than `reach` m from `centre`.
  void forget_beyond(const Eigen::Vector3d& centre, double reach);
  /// The surface in the cell around a point; null if it has too few points or no surface.
  const CellSurface* find(std::size_t level, const Eigen::Vector3d& point) const;

 private:
  struct Cell {
    VoxelKey key;
    Eigen::Vector3d origin;  // m; sums are relative to it
    Eigen::Vector3d sensor;  // m, at the newest point
    detail::PlaneMoments sums = {};
    mutable bool is_fitted = false;
    mutable CellSurface surface = {};
  };
  struct Level {
    VoxelHashTable<> numbers;
    std::vector<Cell> cells;
  };

  CellSurface surface_of(const Cell& cell) const;

  bool with_clutter_;
  double scale_;
  Eigen::Vector3d sensor_ = Eigen::Vector3d::Zero();  // m, at the newest scan
  std::array<Level, kCellLevels> levels_;
  VoxelHashTable<> taken_;
};

}  // namespace dynains
