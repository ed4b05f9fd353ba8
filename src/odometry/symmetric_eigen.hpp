// Eigenvalues and eigenvectors of small symmetric matrices.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace dynains::detail {

/// Eigenvalues of a symmetric matrix, in no order, with orthonormal eigenvectors.
template <std::size_t kSize>
struct SymmetricEigen {
  using Vector = std::array<double, kSize>;
  using Matrix = std::array<Vector, kSize>;

  Vector values = {};
  Matrix vectors = {};  ///< vectors[i] belongs to values[i]
};

/// Jacobi's method. Plain loops, because Eigen's results depend on the instruction set.
template <std::size_t kSize>
SymmetricEigen<kSize> symmetric_eigen(typename SymmetricEigen<kSize>::Matrix m) {
  constexpr int kMostSweeps = 20;
  constexpr double kNegligible = 1e-24;  // squared ratio to the diagonal
  SymmetricEigen<kSize> result;
  for (std::size_t i = 0; i < kSize; ++i) result.vectors[i][i] = 1.0;
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    bool is_diagonal = true;
    for (std::size_t p = 0; p + 1 < kSize; ++p) {
      for (std::size_t q = p + 1; q < kSize; ++q) {
        if (m[p][q] * m[p][q] <= kNegligible * std::abs(m[p][p] * m[q][q])) continue;
        is_diagonal = false;
        const double ratio = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
        const double t =
            (ratio >= 0.0 ? 1.0 : -1.0) / (std::abs(ratio) + std::sqrt(ratio * ratio + 1.0));
        const double c = 1.0 / std::sqrt(t * t + 1.0);
        const double s = t * c;
        for (std::size_t k = 0; k < kSize; ++k) {
          const double a = m[k][p], b = m[k][q];
          m[k][p] = c * a - s * b;
          m[k][q] = s * a + c * b;
        }
        for (std::size_t k = 0; k < kSize; ++k) {
          const double a = m[p][k], b = m[q][k];
          m[p][k] = c * a - s * b;
          m[q][k] = s * a + c * b;
          const double v = result.vectors[p][k], w = result.vectors[q][k];
          result.vectors[p][k] = c * v - s * w;
          result.vectors[q][k] = s * v + c * w;
        }
      }
    }
    if (is_diagonal) break;
  }
  for (std::size_t i = 0; i < kSize; ++i) result.values[i] = m[i][i];
  return result;
}

}  // namespace dynains::detail
