// Eigenvalues and eigenvectors of symmetric matrices.
#include "odometry/symmetric_eigen.hpp"

#include <cstddef>

#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

TEST_CASE("eigenvalues and eigenvectors of a symmetric matrix") {
  using Eigen6 = detail::SymmetricEigen<6>;
  Random random(3);
  Eigen6::Matrix m;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j <= i; ++j) m[i][j] = m[j][i] = random.uniform(-1.0, 1.0);
  }
  const Eigen6 eigen = detail::symmetric_eigen<6>(m);
  for (std::size_t k = 0; k < 6; ++k) {
    for (std::size_t i = 0; i < 6; ++i) {
      double product = 0.0, dot = 0.0;
      for (std::size_t j = 0; j < 6; ++j) {
        product += m[i][j] * eigen.vectors[k][j];
        dot += eigen.vectors[k][j] * eigen.vectors[i][j];
      }
      CHECK(product == Approx(eigen.values[k] * eigen.vectors[k][i]).margin(1e-12));
      CHECK(dot == Approx(i == k ? 1.0 : 0.0).margin(1e-12));
    }
  }
}

}  // namespace
}  // namespace dynains::test
