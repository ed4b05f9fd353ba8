// Alignment of a scan with planes: Gauss-Newton steps on point-to-plane distances.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <vector>

#include "dynains/evidence/voxel_planes.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"

namespace dynains::detail {

/// Normal equations of six unknowns: translation (m) and rotation (rad) about the sensor, along the
/// axes of the map. Plain loops, because Eigen's results depend on the instruction set.
class NormalEquations {
 public:
  using Vector = std::array<double, 6>;

  /// Adds one distance (m) with its derivatives and its weight.
  void add(const Vector& derivatives, double distance, double weight) {
    for (std::size_t i = 0; i < 6; ++i) {
      const double weighted = weight * derivatives[i];
      for (std::size_t j = 0; j <= i; ++j) matrix_[i][j] += weighted * derivatives[j];
      right_[i] -= weighted * distance;
    }
    weights_ += weight;
  }
  /// Adds the squared deviation of unknown number `i` from a value. It does not count in
  /// change().
  void attract(std::size_t i, double value, double weight) {
    attraction_[i] = weight;
    right_[i] += weight * value;
  }

  /// Root mean square of the change of the distances by a step, m.
  double change(const Vector& step) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < i; ++j) sum += 2.0 * matrix_[i][j] * step[i] * step[j];
      sum += matrix_[i][i] * step[i] * step[i];
    }
    return std::sqrt(std::max(sum, 0.0) / std::max(weights_, 1e-12));
  }

  /// Solution by Cholesky decomposition (L D L^T). Each unknown must have an attraction.
  Vector solve() const {
    std::array<Vector, 6> lower = matrix_;
    for (std::size_t i = 0; i < 6; ++i) lower[i][i] += attraction_[i];
    Vector x = right_;
    for (std::size_t j = 0; j < 6; ++j) {
      for (std::size_t i = j + 1; i < 6; ++i) {
        const double factor = lower[i][j] / lower[j][j];
        for (std::size_t k = j + 1; k <= i; ++k) lower[i][k] -= factor * lower[k][j];
        x[i] -= factor * x[j];
      }
    }
    for (std::size_t i = 6; i-- > 0;) {
      for (std::size_t k = i + 1; k < 6; ++k) x[i] -= lower[k][i] * x[k];
      x[i] /= lower[i][i];
    }
    return x;
  }

 private:
  std::array<Vector, 6> matrix_ = {};  // lower triangle
  Vector right_ = {};
  Vector attraction_ = {};
  double weights_ = 0.0;
};

/// Rotates `T` by a small rotation vector (rad) about its own origin, along the axes of the outer
/// frame, and translates it.
inline Eigen::Isometry3d moved(const Eigen::Isometry3d& T, const NormalEquations::Vector& step) {
  const double w[3] = {step[3] / 2.0, step[4] / 2.0, step[5] / 2.0};
  const double scale = 1.0 / std::sqrt(1.0 + w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  const double a = scale, b = scale * w[0], c = scale * w[1], d = scale * w[2];
  const double R[3][3] = {
      {1.0 - 2.0 * (c * c + d * d), 2.0 * (b * c - a * d), 2.0 * (b * d + a * c)},
      {2.0 * (b * c + a * d), 1.0 - 2.0 * (b * b + d * d), 2.0 * (c * d - a * b)},
      {2.0 * (b * d - a * c), 2.0 * (c * d + a * b), 1.0 - 2.0 * (b * b + c * c)}};
  Eigen::Isometry3d result = T;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      result(i, j) = R[i][0] * T(0, j) + R[i][1] * T(1, j) + R[i][2] * T(2, j);
    }
    result(i, 3) = T(i, 3) + step[static_cast<std::size_t>(i)];
  }
  return result;
}

/// Result of an alignment.
struct Alignment {
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  std::size_t matched = 0;  ///< points in voxels with a plane
  std::size_t inliers = 0;  ///< matched points at a small distance from their plane
  /// Root mean square of the change of the distances between points and planes, m. Unlike the
  /// change of the pose, it does not grow in directions without information.
  double change = 0.0;
};

/// Normal equations of the matched points at one pose. Counts the points in `result`. `scale` (m):
/// larger distances have little weight (Geman-McClure).
inline NormalEquations match(PointsView points, VoxelPlanes& planes, double scale,
                             Alignment& result) {
  constexpr double kInlier = 0.12;  // m
  NormalEquations equations;
  result.matched = 0;
  result.inliers = 0;
  const Eigen::Isometry3d& T = result.T_map_sensor;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double turned[3], p[3];
    for (int k = 0; k < 3; ++k) {
      turned[k] = T(k, 0) * static_cast<double>(points.x[i]) +
                  T(k, 1) * static_cast<double>(points.y[i]) +
                  T(k, 2) * static_cast<double>(points.z[i]);
      p[k] = turned[k] + T(k, 3);
    }
    const VoxelPlanes::Plane* const plane = planes.find(p);
    if (plane == nullptr) continue;
    const double distance = plane->distance(p);
    const double(&n)[3] = plane->normal;
    const double loss = scale * scale / (scale * scale + distance * distance);
    equations.add({n[0], n[1], n[2], turned[1] * n[2] - turned[2] * n[1],
                   turned[2] * n[0] - turned[0] * n[2], turned[0] * n[1] - turned[1] * n[0]},
                  distance, loss * loss);
    ++result.matched;
    result.inliers += std::abs(distance) <= kInlier ? 1 : 0;
  }
  return equations;
}

/// Aligns points (m, sensor frame) with planes, from a first estimate of the pose that is wrong by
/// at most half a voxel. Directions without information keep the first estimate.
inline Alignment align(PointsView points, VoxelPlanes& planes, const Eigen::Isometry3d& T_guess) {
  constexpr double kScales[] = {0.4, 0.25, 0.15, 0.1, 0.06, 0.06, 0.06};  // m, by iteration
  constexpr std::size_t kIterations = std::size(kScales);
  constexpr double kPriorTranslation = 0.2, kPriorRotation = 100.0;  // weights
  constexpr double kSmall = 0.01;                                    // m, change by one iteration
  constexpr double kConverged = 0.002;                               // m
  Alignment result;
  result.T_map_sensor = T_guess;
  NormalEquations::Vector sum = {};
  for (std::size_t iteration = 0; iteration < kIterations; ++iteration) {
    NormalEquations equations = match(points, planes, kScales[iteration], result);
    for (std::size_t i = 0; i < 3; ++i) {
      equations.attract(i, -sum[i], kPriorTranslation);
      equations.attract(i + 3, -sum[i + 3], kPriorRotation);
    }
    const NormalEquations::Vector step = equations.solve();
    for (std::size_t i = 0; i < 6; ++i) sum[i] += step[i];
    result.T_map_sensor = moved(result.T_map_sensor, step);
    result.change = equations.change(sum);
    const double change = equations.change(step);
    if (change <= kConverged && iteration + 2 >= kIterations) break;
    if (change <= kSmall) iteration = std::max(iteration, kIterations - 3);
  }
  return result;
}

}  // namespace dynains::detail
