#include "dynains/pose.hpp"

#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

TEST_CASE("transforms by coefficients equal those of Eigen") {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Isometry3d a = random.pose(100.0), b = random.pose(100.0);
    const Eigen::Matrix3d R_a = a.linear(), R_b = b.linear();
    CHECK(detail::composed(a, b).isApprox(a * b, 1e-12));
    CHECK(detail::composed(R_a, R_b).isApprox(R_a * R_b, 1e-12));
    CHECK(detail::inverted(a).isApprox(a.inverse(), 1e-12));
    Eigen::Isometry3d rotated = a;
    rotated.rotate(R_b.transpose());
    CHECK(detail::rotated(a, R_b).isApprox(rotated, 1e-12));
    CHECK(detail::distance(a, b) == Approx((a.translation() - b.translation()).norm()));

    Eigen::Isometry3d skewed = a;
    skewed.linear() += 1e-2 * Eigen::Matrix3d::Random();
    const Eigen::Matrix3d S = skewed.linear();
    const Eigen::Matrix3d error = S.transpose() * S - Eigen::Matrix3d::Identity();
    CHECK(detail::rotation_error(skewed) == Approx(error.cwiseAbs().maxCoeff()));
  }
}

}  // namespace
}  // namespace dynains::test
