#include "poses/pose_fit.hpp"

#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "poses/scan_registration.hpp"
#include "support/catch.hpp"

using namespace dynains;

namespace {

/// Rigid motion of a rotation vector (rad) and a translation (m).
Pose motion_of(const Vector6& rotation_and_translation) {
  Vector6 step;
  step << rotation_and_translation.tail<3>(), kLever * rotation_and_translation.head<3>();
  return stepped(Pose::Identity(), step);
}

/// Motions of a sensor that is mounted at `X` on a body; `limits`: rotation (rad) and translation
/// (m) of the body along each axis. Noise of 5 mm.
struct Drive {
  Drive(const Eigen::Isometry3d& X, const Vector6& limits, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> any(-1.0, 1.0);
    for (std::size_t i = 0; i < 24; ++i) {
      Vector6 motion = limits;
      for (double& value : motion) value *= any(random);
      Vector6 noise;
      for (double& value : noise) value = 0.0005 * any(random);
      noise.tail<3>() *= 10.0;
      bodies.push_back(motion_of(motion));
      motions.push_back({i / 2, i, i + 1, X.inverse() * bodies.back() * X * motion_of(noise),
                         Vector6::Zero(), 0.0});
    }
  }
  BodyMotion body() const {
    return [this](const RegisteredMotion& m) { return std::optional(bodies[m.first]); };
  }

  std::vector<Pose> bodies;
  std::vector<RegisteredMotion> motions;
};

Eigen::Isometry3d mounting(double yaw, double roll, const Eigen::Vector3d& t) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
  X.translation() = t;
  return X;
}

double angle_between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return std::abs(Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle());
}

}  // namespace

TEST_CASE("Motions about all axes determine the extrinsic") {
  const unsigned seed = GENERATE(1U, 2U, 3U, 4U);
  const Eigen::Isometry3d X =
      mounting(1.1 * static_cast<double>(seed), seed % 2 == 0 ? 3.1 : 0.2, {1.5, -0.7, 0.4});
  Vector6 limits;
  limits << 0.2, 0.2, 0.3, 2.0, 1.0, 0.5;
  const Drive drive(X, limits, seed);
  const auto found = fit_extrinsic(drive.motions, drive.body());
  REQUIRE(found);
  CHECK(angle_between(*found, X) < 0.005);
  CHECK((found->translation() - X.translation()).norm() < 0.03);
  CHECK(motion_error(drive.motions, drive.body(), *found).at_points < 0.02);
  CHECK(motion_error(drive.motions, drive.body(), Eigen::Isometry3d::Identity()).at_points > 0.5);
}

TEST_CASE("Parts of the extrinsic that the motions do not determine stay 0") {
  const Eigen::Isometry3d X = mounting(0.5, 0.0, {1.5, -0.7, 0.4});
  Vector6 level;
  level << 0, 0, 0.3, 2.0, 0, 0;
  const Drive bends(X, level, 5);
  const auto found = fit_extrinsic(bends.motions, bends.body());
  REQUIRE(found);
  CHECK(angle_between(*found, X) < 0.005);
  CHECK((found->translation() - X.translation()).head<2>().norm() < 0.05);
  CHECK(std::abs(found->translation().z()) < 0.05);

  level[2] = 0.0;
  const Drive straight(X, level, 6);
  const auto on_a_line = fit_extrinsic(straight.motions, straight.body());
  REQUIRE(on_a_line);
  CHECK(on_a_line->translation().norm() < 0.1);
}

TEST_CASE("Too few motions determine no extrinsic") {
  const Drive drive(Eigen::Isometry3d::Identity(), Vector6::Ones(), 7);
  const std::vector<RegisteredMotion> few(drive.motions.begin(), drive.motions.begin() + 3);
  CHECK_FALSE(fit_extrinsic(few, drive.body()));
}
