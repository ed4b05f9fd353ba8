#include "dynains/adapters/odometry_corrector.hpp"

#include <vector>

#include "support/box_street.hpp"
#include "support/catch.hpp"

namespace dynains::test {
namespace {

std::vector<BoxScan> drive() {
  return drive_along({{{5, 4, 0}, {9, 6, 1.5}, 1}, {{14, -7, 0}, {15, -5, 3}, 2}}, 0.0, 6.0);
}

using Cloud = std::vector<Eigen::Vector3f>;

Cloud cloud_of(const BoxScan& scan) {
  Cloud cloud;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    cloud.emplace_back(scan.points.x[i], scan.points.y[i], scan.points.z[i]);
  }
  return cloud;
}

// The true pose of a scan, 5 cm to the left from the third scan on.
Eigen::Isometry3d odometry_pose(const std::vector<BoxScan>& scans, std::size_t i) {
  Eigen::Isometry3d T = scans[i].T_world_sensor;
  if (i >= 3) T.translation().y() += 0.05;
  return T;
}

TEST_CASE("The corrector follows the exact poses of a drive with a wrong motion") {
  const std::vector<BoxScan> scans = drive();
  OdometryCorrector corrector;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const auto result = corrector.correct(cloud_of(scans[i]), odometry_pose(scans, i),
                                          0.1 * static_cast<double>(i));
    CHECK(result.frame.newest.labels.size() == scans[i].points.size());
    CHECK(detail::distance(result.T_world_sensor, scans[i].T_world_sensor) < 0.01);
  }
}

TEST_CASE("The motion after a scan that is refused begins at the last one that was taken") {
  const std::vector<BoxScan> scans = drive();
  OdometryCorrector without, with;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const double time = 0.1 * static_cast<double>(i);
    const Eigen::Isometry3d T = odometry_pose(scans, i);
    const Pose expected = without.correct(cloud_of(scans[i]), T, time).T_world_sensor;
    CHECK(with.correct(cloud_of(scans[i]), T, time).T_world_sensor.isApprox(expected, 0.0));
    const Eigen::Isometry3d T_far(Eigen::Translation3d(50, 0, 0));
    CHECK_THROWS_AS(with.correct(cloud_of(scans[i]), T_far, time),
                    PoseError);  // the same time again
  }
}

TEST_CASE("Without common surfaces the motion of the odometry stays") {
  const std::vector<BoxScan> scans = drive();
  OdometryCorrector corrector;
  corrector.correct(cloud_of(scans[0]), scans[0].T_world_sensor, 0.0);
  const Eigen::Isometry3d T = scans[0].T_world_sensor * Eigen::Translation3d(1, 0, 0);
  const auto result = corrector.correct(Cloud(), T, 0.1);
  CHECK_FALSE(result.frame.pose_residual);
  CHECK(detail::distance(result.T_world_sensor, T) < 1e-9);
}

TEST_CASE("Matrices and transforms of float and double are poses") {
  const std::vector<BoxScan> scans = drive();
  const Eigen::Isometry3d T = scans[1].T_world_sensor;
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = T.matrix();
  CHECK(to_pose(T).isApprox(T, 0.0));
  CHECK(to_pose(T.matrix()).isApprox(T, 0.0));
  CHECK(to_pose(rows).isApprox(T, 0.0));
  CHECK(to_pose(Eigen::Affine3d(T)).isApprox(T, 0.0));
  CHECK(to_pose(T.cast<float>()).isApprox(T, 1e-6));

  DynaInsRemover remover;
  CHECK(remover.push(cloud_of(scans[0]), T.matrix()).newest.T_world_sensor.isApprox(T, 1e-12));
  CHECK(remover.push(cloud_of(scans[1]), T.cast<float>(), 1.0)
            .newest.T_world_sensor.isApprox(T, 1e-6));
}

TEST_CASE("An epoch that the caller begins is told, and has no residual") {
  const std::vector<BoxScan> scans = drive();
  DynaInsRemover remover;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (i == 4) remover.start_epoch();
    const FrameResult frame = remover.push(cloud_of(scans[i]), scans[i].T_world_sensor);
    CHECK(frame.began_epoch.has_value() == (i == 0 || i == 4));
    CHECK(frame.pose_residual.has_value() == (i != 0 && i != 4));
  }
}

}  // namespace
}  // namespace dynains::test
