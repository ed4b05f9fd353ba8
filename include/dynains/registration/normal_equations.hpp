// Sums of weighted squares, by which points are moved to surfaces: the equations of Gauss-Newton
// steps, their weights and their solution.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "dynains/pose.hpp"

namespace dynains::detail {

/// A vector and a square matrix. Plain loops, because Eigen's results depend on the instruction
/// set.
template <std::size_t kSize>
using VectorOf = std::array<double, kSize>;
template <std::size_t kSize>
using MatrixOf = std::array<VectorOf<kSize>, kSize>;

/// Solution x of m x = right for a positive definite matrix, by Cholesky decomposition (L D L^T).
/// Only the lower triangle of `m` is read.
template <std::size_t kSize>
VectorOf<kSize> solve_symmetric(MatrixOf<kSize> m, VectorOf<kSize> right) {
  for (std::size_t j = 0; j < kSize; ++j) {
    for (std::size_t i = j + 1; i < kSize; ++i) {
      const double factor = m[i][j] / m[j][j];
      for (std::size_t k = j + 1; k <= i; ++k) m[i][k] -= factor * m[k][j];
      right[i] -= factor * right[j];
    }
  }
  for (std::size_t i = kSize; i-- > 0;) {
    for (std::size_t k = i + 1; k < kSize; ++k) right[i] -= m[k][i] * right[k];
    right[i] /= m[i][i];
  }
  return right;
}

/// Weighted squares of distances (m) that are linear in the unknowns.
template <std::size_t kSize>
class NormalEquations {
 public:
  using Vector = VectorOf<kSize>;
  using Matrix = MatrixOf<kSize>;

  /// Adds one distance (m) with its derivatives and its weight.
  void add(const Vector& derivatives, double distance, double weight) {
    for (std::size_t i = 0; i < kSize; ++i) {
      const double weighted = weight * derivatives[i];
      for (std::size_t j = 0; j <= i; ++j) matrix_[i][j] += weighted * derivatives[j];
      right_[i] -= weighted * distance;
    }
    squares_ += weight * distance * distance;
    weights_ += weight;
  }

  /// Adds the squared deviation of unknown number `i` from a value. It does not count in change()
  /// and variance().
  void attract(std::size_t i, double value, double weight) {
    attraction_[i] = weight;
    right_[i] += weight * value;
  }

  NormalEquations& operator-=(const NormalEquations& other) {
    for (std::size_t i = 0; i < kSize; ++i) {
      for (std::size_t j = 0; j <= i; ++j) matrix_[i][j] -= other.matrix_[i][j];
      right_[i] -= other.right_[i];
    }
    squares_ -= other.squares_;
    weights_ -= other.weights_;
    return *this;
  }

  /// Sums of the products of derivatives (lower triangle), and the right side.
  const Matrix& matrix() const { return matrix_; }
  const Vector& right() const { return right_; }

  /// Mean square of the distances, m^2.
  double variance() const { return squares_ / std::max(weights_, kMinWeight); }

  /// Root mean square of the change of the distances by a step of the first unknowns, m.
  template <std::size_t kSteps>
  double change(const VectorOf<kSteps>& step) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < kSteps; ++i) {
      for (std::size_t j = 0; j < i; ++j) sum += 2.0 * matrix_[i][j] * step[i] * step[j];
      sum += matrix_[i][i] * step[i] * step[i];
    }
    return std::sqrt(std::max(sum, 0.0) / std::max(weights_, kMinWeight));
  }

  /// Solution. Each unknown must have an attraction.
  Vector solve() const { return solve_symmetric<kSize>(with_attractions(), right_); }

  /// Inverse of the matrix of the equations, with attractions.
  Matrix inverse() const {
    const Matrix all = with_attractions();
    Matrix inverse = {};
    for (std::size_t i = 0; i < kSize; ++i) {
      inverse[i][i] = 1.0;
      inverse[i] = solve_symmetric<kSize>(all, inverse[i]);
    }
    return inverse;
  }

 private:
  static constexpr double kMinWeight = 1e-12;  // against division by zero

  Matrix with_attractions() const {
    Matrix all = matrix_;
    for (std::size_t i = 0; i < kSize; ++i) all[i][i] += attraction_[i];
    return all;
  }

  Matrix matrix_ = {};  // lower triangle
  Vector right_ = {};
  Vector attraction_ = {};
  double squares_ = 0.0;
  double weights_ = 0.0;
};

/// Weight of a distance of which the square is given (m^2), (0, 1] (Geman and McClure 1987).
/// `scale`: m, distance with the weight 1/4.
inline double robust_weight(double squared, double scale) {
  const double loss = scale * scale / (scale * scale + squared);
  return loss * loss;
}

/// Translation (m) and rotation (rad) about the sensor, along the axes of the map.
using PoseStep = VectorOf<6>;
using PoseCovariance = MatrixOf<6>;

/// Rotates `T` by a small rotation vector (rad) about its own origin, along the axes of the outer
/// frame, and translates it.
inline Pose moved(const Pose& T, const PoseStep& step) {
  const double w[3] = {step[3] / 2.0, step[4] / 2.0, step[5] / 2.0};
  const double scale = 1.0 / std::sqrt(1.0 + w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  const Quaternion turn(scale, scale * w[0], scale * w[1], scale * w[2]);
  Pose result = T;
  result.linear() = composed(turn.toRotationMatrix(), T.linear());
  for (int i = 0; i < 3; ++i) result(i, 3) += step[static_cast<std::size_t>(i)];
  return result;
}

}  // namespace dynains::detail
