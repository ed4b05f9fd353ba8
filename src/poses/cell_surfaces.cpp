#include "cell_surfaces.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace dynains {

CellSurface surface_of(const CellMoments& moments, double edge) {
  constexpr double kFewest = 6.0;   // points
  constexpr double kThin = 0.15;    // ratio of the extents across and along a plane
  constexpr double kNarrow = 0.2;   // ratio of the extents of a line
  constexpr double kSteep = 0.8;    // z of a pole
  constexpr double kUpright = 0.5;  // most z of the normal of an upright plane
  CellSurface surface;
  if (moments.count < kFewest) return surface;
  const Eigen::Vector3d mean = moments.sum / moments.count;
  surface.mean = moments.origin + mean;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments.squares / moments.count -
                                                              mean * mean.transpose());
  const Eigen::Vector3d extent = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  const Eigen::Matrix3d& axes = solver.eigenvectors();
  if (extent[2] < 0.05 * edge) return surface;
  surface.directions = {axes.col(0), axes.col(1)};
  if (extent[1] < kNarrow * extent[2]) {
    if (std::abs(axes(2, 2)) < kSteep) return surface;
    surface.direction_count = 2;
    surface.is_upright = true;
  } else if (extent[0] <= kThin * extent[1] + 0.03) {
    surface.direction_count = 1;
    surface.is_upright = std::abs(axes(2, 0)) < kUpright;
  }
  return surface;
}

Pose motion_of(const Vector6& rotation_and_translation) {
  const Eigen::Vector3d w = rotation_and_translation.head<3>();
  const double angle = w.norm();
  Pose T = Pose::Identity();
  if (angle > 0.0) T.linear() = Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
  T.translation() = rotation_and_translation.tail<3>();
  return T;
}

double NormalEquations::uncertainty() const {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(translation_covariance());
  return kPointDeviation * std::sqrt(std::max(0.0, solver.eigenvalues()[2]));
}

}  // namespace dynains
