#include "dynains/pose.hpp"

#include "support/catch.hpp"
#include "support/random.hpp"

namespace dynains::test {
namespace {

Eigen::Isometry3d random_pose(Random& random) {
  const Eigen::Vector3d ones = Eigen::Vector3d::Ones();
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() =
      Eigen::AngleAxisd(random.uniform(0.0, 2.0 * M_PI), random.vector(-ones, ones).normalized())
          .toRotationMatrix();
  T.translation() = random.vector(-100.0 * ones, 100.0 * ones);
  return T;
}

TEST_CASE("transforms by coefficients equal those of Eigen") {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Isometry3d a = random_pose(random), b = random_pose(random);
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
