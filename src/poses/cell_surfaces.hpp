// Planes and upright poles in the cells of a grid, and the fit of points to them.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>

#include "dynains/pose.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

using Vector6 = Eigen::Matrix<double, 6, 1, Eigen::DontAlign>;
// Not ldlt() and inverse(), whose types have the alignment that depends on flags.
using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::DontAlign>;

/// Edges of the cells (m) by level, from coarse to fine.
inline constexpr std::size_t kCellLevels = 3;
inline constexpr std::array<double, kCellLevels> kCellEdges = {4.0, 2.0, 1.0};

/// Deviation (m) of the distance of a point to its surface. Distances of neighbouring points are
/// correlated, so it is a large value.
inline constexpr double kPointDeviation = 0.2;

/// The cell of edge `edge` (m) around a point.
inline VoxelKey cell_key(const Eigen::Vector3d& p, double edge) {
  const auto index = [&](double coordinate) {
    const double cell = coordinate / edge;
    const auto number = static_cast<std::int64_t>(cell);
    return number - (static_cast<double>(number) > cell ? 1 : 0);  // floor without a call of libm
  };
  return voxel_key(index(p.x()), index(p.y()), index(p.z()));
}

/// Sums over the points of a cell.
struct CellMoments {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< m; sums are relative to it
  double count = 0.0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();

  void add(const Eigen::Vector3d& point) {
    const Eigen::Vector3d relative = point - origin;
    count += 1.0;
    sum += relative;
    squares += relative * relative.transpose();
  }
  /// Adds those of another cell with the same origin.
  void add(const CellMoments& other) {
    count += other.count;
    sum += other.sum;
    squares += other.squares;
  }
};

/// Plane, or upright pole, through the points of a cell.
struct CellSurface {
  Eigen::Vector3d mean;                       ///< m
  std::array<Eigen::Vector3d, 2> directions;  ///< orthonormal; it determines places along them
  std::size_t direction_count = 0;            ///< 0: no surface, 1: plane, 2: pole
  bool is_upright = false;
};

/// `edge`: m, of the cell. Rings of a sensor lie along lines on the ground that move with the
/// sensor, so a line is a surface only if it is upright.
CellSurface surface_of(const CellMoments& moments, double edge);

/// Rigid motion of a rotation vector (rad) and a translation (m).
Pose motion_of(const Vector6& rotation_and_translation);

/// Normal equations of a motion that moves points to surfaces. Rotation comes before translation.
class NormalEquations {
 public:
  struct Fit {
    double squared;  ///< m^2, distance to the surface
    double weight;   ///< Geman-McClure, (0, 1]
  };
  /// Adds a point (m, moved). `scale`: m, distance at which its weight is a fourth.
  Fit add(const Eigen::Vector3d& point, const CellSurface& surface, double scale) {
    std::array<double, 2> distances{};
    double squared = 0.0;
    for (std::size_t k = 0; k < surface.direction_count; ++k) {
      distances[k] = surface.directions[k].dot(point - surface.mean);
      squared += distances[k] * distances[k];
    }
    const double root = 1.0 / (1.0 + squared / (scale * scale));
    const double weight = root * root;
    for (std::size_t k = 0; k < surface.direction_count; ++k) {
      Vector6 J;
      J << point.cross(surface.directions[k]), surface.directions[k];
      add(J, distances[k], weight);
    }
    ++count_;
    return {squared, weight};
  }
  /// Adds a point that is `distance` (m) from its place, with the derivative of this distance.
  void add(const Vector6& jacobian, double distance, double weight) {
    for (Eigen::Index i = 0; i < 6; ++i) hessian_.col(i) += (weight * jacobian[i]) * jacobian;
    gradient_ += (weight * distance) * jacobian;
  }

  std::size_t count() const { return count_; }  ///< points
  Matrix6 hessian() const { return hessian_.selfadjointView<Eigen::Lower>(); }
  /// The step that solves the equations, slightly damped.
  Vector6 step() const {
    const Matrix6 damped = hessian() + 1e-3 * Matrix6::Identity();
    return -Eigen::LDLT<Matrix6>(damped).solve(gradient_);
  }
  /// Deviation (m) of the translation along its least certain direction.
  double uncertainty() const;
  /// Covariance of the translation (m^2) for points with a deviation of 1 m.
  Eigen::Matrix3d translation_covariance() const {
    const Matrix6 damped = hessian() + 1e-6 * Matrix6::Identity();
    const Matrix6 covariance = Eigen::PartialPivLU<Matrix6>(damped).inverse();
    return covariance.bottomRightCorner<3, 3>();
  }

 private:
  Matrix6 hessian_ = Matrix6::Zero();  // its lower triangle counts
  Vector6 gradient_ = Vector6::Zero();
  std::size_t count_ = 0;
};

/// Gauss-Newton steps from `T`, at most `most`, until they are shorter than 0.1 mm and `turn` (rad)
/// or fewer than 30 points meet a surface. `equations_at(T)` returns NormalEquations.
template <class EquationsAt>
Pose gauss_newton(Pose T, int most, double turn, EquationsAt&& equations_at) {
  constexpr std::size_t kFewest = 30;
  for (int k = 0; k < most; ++k) {
    const NormalEquations equations = equations_at(T);
    if (equations.count() < kFewest) break;
    const Vector6 step = equations.step();
    if (!step.allFinite()) break;
    T = motion_of(step) * T;
    if (step.head<3>().norm() < turn && step.tail<3>().norm() < 1e-4) break;
  }
  return T;
}

}  // namespace dynains
