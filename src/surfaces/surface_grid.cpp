#include "dynains/surfaces/surface_grid.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace dynains {
void SurfaceGrid::insert(const Eigen::Vector3d& point) {
  constexpr double kApart = 0.1;  // m
  if (!adds(taken_, voxel_at(point, scale_ * kApart))) return;
  for (std::size_t level = 0; level < kCellLevels; ++level) {
    Level& at = levels_[level];
    const VoxelKey key = voxel_at(point, scale_ * kCellEdges[level]);
    const std::uint32_t number = at.numbers.insert(key);
    if (number == at.cells.size()) {
      at.cells.emplace_back();
      at.cells.back().key = key;
      at.cells.back().origin = point;
    }
    Cell& cell = at.cells[number];
    const Eigen::Vector3d relative = point - cell.origin;
    cell.sums.add(relative.x(), relative.y(), relative.z(), 1.0);
    cell.sensor = sensor_;
    cell.is_fitted = false;
  }
}

void SurfaceGrid::forget_beyond(const Eigen::Vector3d& centre, double reach) {
  const auto is_far = [&](const Cell& cell) {
    return (cell.origin - centre).squaredNorm() > reach * reach;
  };
  taken_.clear();
  for (Level& level : levels_) {
    level.cells.erase(std::remove_if(level.cells.begin(), level.cells.end(), is_far),
                      level.cells.end());
    level.numbers.clear();
    for (const Cell& cell : level.cells) level.numbers.insert(cell.key);
  }
}

const CellSurface* SurfaceGrid::find(std::size_t level, const Eigen::Vector3d& point) const {
  const std::size_t coarsest = with_clutter_ ? 0 : level;
  for (std::size_t k = level + 1; k-- > coarsest;) {
    const Level& at = levels_[k];
    const std::uint32_t number = at.numbers.find(voxel_at(point, scale_ * kCellEdges[k]));
    if (number == kNoIndex) continue;
    const Cell& cell = at.cells[number];
    if (!cell.is_fitted) cell.surface = surface_of(cell);
    cell.is_fitted = true;
    if (cell.surface.direction_count > 0) return &cell.surface;
  }
  return nullptr;
}

CellSurface SurfaceGrid::surface_of(const Cell& cell) const {
  constexpr double kMin = 6.0;      // points
  constexpr double kThin = 0.15;    // ratio of the extents across and along a plane
  constexpr double kNarrow = 0.2;   // ratio of the extents of a line
  constexpr double kUpright = 0.5;  // most sine of the tilt of what is upright
  CellSurface surface;
  const detail::PlaneMoments& sums = cell.sums;
  if (sums.count < kMin) return surface;
  const Eigen::Vector3d mean = Eigen::Vector3d(sums.x, sums.y, sums.z) / sums.count;
  surface.mean = cell.origin + mean;
  Eigen::Matrix3d covariance;
  covariance << sums.xx, sums.xy, sums.xz, sums.xy, sums.yy, sums.yz, sums.xz, sums.yz, sums.zz;
  covariance = (covariance / sums.count - mean * mean.transpose()).eval();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  const Eigen::Vector3d extent = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  const Eigen::Matrix3d& axes = solver.eigenvectors();
  surface.directions = {axes.col(0), axes.col(1)};
  if (extent[1] < kNarrow * extent[2]) {
    // Rings of a sensor lie along lines on the ground that move with the sensor.
    if (std::hypot(axes(0, 2), axes(1, 2)) > kUpright) return surface;
    surface.direction_count = 2;
    surface.is_upright = true;
  } else if (extent[0] <= kThin * extent[1] + 0.03) {
    const Eigen::Vector3d beam = surface.mean - cell.sensor;
    // One scan needs distant ground, which a map has seen from nearer.
    const double edge_on = with_clutter_ ? 0.1 : 0.04;
    if (detail::is_trace_of_beam({beam[0], beam[1], beam[2]}, {axes(0, 0), axes(1, 0), axes(2, 0)},
                                 sums, edge_on))
      return surface;
    surface.direction_count = 1;
    surface.is_upright = std::abs(axes(2, 0)) < kUpright;
  } else if (with_clutter_) {
    surface.direction_count = 2;
    surface.variance = extent[1] * extent[1];
  }
  return surface;
}

}  // namespace dynains
