#include "cell_surfaces.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace dynains {
namespace {

/// Whether a plane is the trace of one beam: on persons, in foliage or on a rough wall its points
/// lie in a plane that contains the beam, and in a map they are no longer along it than its noise.
/// Such a plane moves with the sensor. One scan needs distant ground, a map has seen it nearer.
bool is_trace_of_beam(const Eigen::Vector3d& beam, const Eigen::Vector3d& normal,
                      const Eigen::Matrix3d& covariance, bool in_map) {
  constexpr double kDistance = 0.5;                // m, of the plane from the sensor, in one scan
  constexpr double kEdgeOn = 0.04, kNearly = 0.1;  // sines of the angle between beam and plane
  constexpr double kGrazing = 0.3;                 // the same; less steep planes are long
  constexpr double kMinLength = 0.2;               // m, standard deviation along the beam
  const double across = normal.dot(beam);
  const double sine = std::abs(across) / beam.norm();
  if (!in_map) return std::abs(across) < kDistance && sine < kEdgeOn;
  if (sine < kNearly || sine >= kGrazing) return sine < kNearly;
  const Eigen::Vector3d along = (beam - across * normal).normalized();
  return along.dot(covariance * along) < kMinLength * kMinLength;
}

}  // namespace

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
    cell.count += 1.0;
    cell.sum += relative;
    cell.squares += relative * relative.transpose();
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
    const std::uint32_t number = levels_[k].numbers.find(voxel_at(point, scale_ * kCellEdges[k]));
    if (number == kNoIndex) continue;
    const Cell& cell = levels_[k].cells[number];
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
  if (cell.count < kMin) return surface;
  const Eigen::Vector3d mean = cell.sum / cell.count;
  surface.mean = cell.origin + mean;
  const Eigen::Matrix3d covariance = cell.squares / cell.count - mean * mean.transpose();
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
    if (is_trace_of_beam(surface.mean - sensor_, axes.col(0), covariance, with_clutter_))
      return surface;
    surface.direction_count = 1;
    surface.is_upright = std::abs(axes(2, 0)) < kUpright;
  } else if (with_clutter_) {
    surface.direction_count = 2;
    surface.variance = extent[1] * extent[1];
  }
  return surface;
}

Pose stepped(const Pose& T, const Vector6& step, double lever) {
  const Eigen::Vector3d turn = step.tail<3>() / lever;
  Pose result = T;
  result.translation() += step.head<3>();
  result.linear() =
      Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()).toRotationMatrix() * T.linear();
  return orthonormalized(result);
}

NormalEquations::Solution NormalEquations::solve() const {
  // The singular vectors of a symmetric matrix are its eigenvectors. Eigen's eigenvalue solver is
  // not used, because it aligns its matrices.
  const Eigen::JacobiSVD<Matrix6> solver(hessian_, Eigen::ComputeFullU);
  Solution solution;
  for (Eigen::Index k = 0; k < 6; ++k) {
    const Vector6 direction = solver.matrixU().col(k);
    const double value = std::max(solver.singularValues()[k], 1e-6);
    const Eigen::Vector3d way = direction.head<3>();
    solution.covariance += way * way.transpose() / value;
    if (value < least_) {
      ++solution.free_directions;
    } else {
      solution.step -= direction * (direction.dot(gradient_) / value);
    }
  }
  return solution;
}

}  // namespace dynains
