// Normal equations of a pose.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace dynains::detail {

/// Normal equations of six unknowns: translation (m) and rotation (rad) about the sensor, along the
/// axes of the map. Plain loops, because Eigen's results depend on the instruction set.
class NormalEquations {
 public:
  using Vector = std::array<double, 6>;
  using Matrix = std::array<Vector, 6>;

  /// Adds one distance (m) with its derivatives and its weight.
  void add(const Vector& derivatives, double distance, double weight) {
    for (std::size_t i = 0; i < 6; ++i) {
      const double weighted = weight * derivatives[i];
      for (std::size_t j = 0; j <= i; ++j) matrix_[i][j] += weighted * derivatives[j];
      right_[i] -= weighted * distance;
    }
    squares_ += weight * distance * distance;
    weights_ += weight;
  }
  NormalEquations& operator+=(const NormalEquations& other) { return add_multiple(other, 1.0); }
  NormalEquations& operator-=(const NormalEquations& other) { return add_multiple(other, -1.0); }

  /// Adds the squared deviation of unknown number `i` from a value. It does not count in change()
  /// and variance().
  void attract(std::size_t i, double value, double weight) {
    attraction_[i] = weight;
    right_[i] += weight * value;
  }

  /// Weight of the attraction of unknown number `i`.
  double attraction(std::size_t i) const { return attraction_[i]; }

  /// Whether no distance with a positive weight was added.
  bool empty() const { return weights_ <= 0.0; }
  /// Mean square of the distances, m^2.
  double variance() const { return squares_ / std::max(weights_, 1e-12); }

  /// The right side.
  const Vector& right() const { return right_; }

  /// Product of `a`, the sum of the products of derivatives without attractions, and `b`.
  double product(const Vector& a, const Vector& b) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < i; ++j) sum += matrix_[i][j] * (a[i] * b[j] + a[j] * b[i]);
      sum += matrix_[i][i] * a[i] * b[i];
    }
    return sum;
  }

  /// Root mean square of the change of the distances by a step, m.
  double change(const Vector& step) const {
    return std::sqrt(std::max(product(step, step), 0.0) / std::max(weights_, 1e-12));
  }

  /// Solution. Each unknown must have an attraction.
  Vector solve() const { return solve(right_); }

  /// Solution for another right side, by Cholesky decomposition (L D L^T).
  Vector solve(const Vector& right) const {
    Matrix lower = matrix_;
    for (std::size_t i = 0; i < 6; ++i) lower[i][i] += attraction_[i];
    Vector x = right;
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
  NormalEquations& add_multiple(const NormalEquations& other, double factor) {
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j <= i; ++j) matrix_[i][j] += factor * other.matrix_[i][j];
      right_[i] += factor * other.right_[i];
    }
    squares_ += factor * other.squares_;
    weights_ += factor * other.weights_;
    return *this;
  }

  Matrix matrix_ = {};  // lower triangle
  Vector right_ = {};
  Vector attraction_ = {};
  double squares_ = 0.0;
  double weights_ = 0.0;
};

}  // namespace dynains::detail
