// Verdicts under inexact poses, judged by the exact ones.
#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/simulated_runs.hpp"

namespace dynains::test {
namespace {

using simulation::SimulatedScan;

const std::vector<SimulatedScan>& street() {
  static const std::vector<SimulatedScan> scans = [] {
    simulation::Config config;
    config.scene = simulation::Scene::kUrban;
    config.sensor = simulation::Sensor::kOs1_64;
    config.scans = 40;
    config.seed = 33;
    return simulate(config);
  }();
  return scans;
}

// The street with `disturb(i, T_world_sensor)` as poses.
template <class Disturb>
std::vector<SimulatedScan> with_poses(Disturb&& disturb) {
  std::vector<SimulatedScan> scans = street();
  for (std::size_t i = 0; i < scans.size(); ++i) {
    scans[i].T_world_sensor = disturb(i, scans[i].T_world_sensor);
  }
  return scans;
}

std::vector<SimulatedScan> with_noise(double metres, double degrees) {
  Random random(5);
  return with_poses([&](std::size_t, Eigen::Isometry3d T) {
    Eigen::Vector3d turn;
    for (int k = 0; k < 3; ++k) {
      T.translation()[k] += metres * random.normal();
      turn[k] = degrees * M_PI / 180.0 * random.normal();
    }
    T.linear() =
        T.linear() * Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()).toRotationMatrix();
    return T;
  });
}

StaticByVerdict judged(const std::vector<SimulatedScan>& scans, double pose_tolerance) {
  DynaInsRemover::Config config;
  config.build_map = false;
  config.evidence.pose_tolerance = pose_tolerance;
  return static_points(scans, config);
}
StaticByVerdict judged(const std::vector<SimulatedScan>& scans) {
  return judged(scans, DynaInsRemover::Config().evidence.pose_tolerance);
}

TEST_CASE("exact poses: the check of poses changes no verdict") {
  const StaticByVerdict checked = judged(street());
  const StaticByVerdict unchecked = judged(street(), 0.0);
  CHECK(checked.final == unchecked.final);
  CHECK(checked.newest == unchecked.newest);
}

TEST_CASE("noise, a jump and a drift of poses cost little") {
  const evaluation::VoxelScore exact = score(street(), judged(street()).final);
  REQUIRE(exact.f1() > 0.95);

  const auto scored = [](const std::vector<SimulatedScan>& scans) {
    return score(street(), judged(scans).final);
  };
  CHECK(scored(with_noise(0.03, 0.1)).f1() == Approx(exact.f1()).margin(0.006));
  const evaluation::VoxelScore noisy = scored(with_noise(0.1, 0.3));
  CHECK(noisy.preservation_rate() >= 98.5);
  CHECK(noisy.f1() >= 0.93);

  const evaluation::VoxelScore jump = scored(with_poses([](std::size_t i, Eigen::Isometry3d T) {
    if (i >= street().size() / 2) T.translation() += Eigen::Vector3d(0.3, 0.4, 0.0);
    return T;
  }));
  CHECK(jump.preservation_rate() >= 98.0);
  CHECK(jump.f1() == Approx(exact.f1()).margin(0.006));

  const Eigen::Vector3d first = street().front().T_world_sensor.translation();
  const evaluation::VoxelScore drift = scored(with_poses([&](std::size_t, Eigen::Isometry3d T) {
    const double path = (T.translation() - first).norm();
    T.translation() += 0.01 * path * Eigen::Vector3d(0.8, 0.6, 0.1);
    return T;
  }));
  CHECK(drift.f1() == Approx(exact.f1()).margin(0.003));
}

TEST_CASE("a push gives the residual of its pose") {
  const std::vector<SimulatedScan>& scans = street();
  const auto push_all = [&](const DynaInsRemover::Config& config) {
    DynaInsRemover remover(config);
    std::vector<std::optional<PoseResidual>> residuals;
    for (std::size_t i = 0; i < 6; ++i) {
      Eigen::Isometry3d T = scans[i].T_world_sensor;
      if (i == 4) T.translation() += Eigen::Vector3d(0.0, 0.2, 0.0);
      const RawPoints<float> points{scans[i].xyzi.data(), scans[i].labels.size(), 4};
      const FrameResult frame = remover.push(points, T, scans[i].time);
      CHECK((frame.newest.T_world_sensor.matrix() - T.matrix()).norm() < 1e-9);
      residuals.push_back(frame.pose_residual);
    }
    return residuals;
  };
  const auto residuals = push_all({});
  CHECK_FALSE(residuals[0]);
  for (std::size_t i = 1; i < residuals.size(); ++i) {
    REQUIRE(residuals[i]);
    CHECK(residuals[i]->translation == Approx(i < 4 ? 0.0 : 0.2).margin(0.04));
    const Eigen::Isometry3d T_motion =
        scans[i - 1].T_world_sensor.inverse() * scans[i].T_world_sensor;
    const Eigen::Vector3d aligned = residuals[i]->T_previous_newest.translation();
    CHECK((aligned - T_motion.translation()).norm() < 0.04);
  }
  DynaInsRemover::Config unchecked;
  unchecked.evidence.pose_tolerance = 0.0;
  CHECK_FALSE(push_all(unchecked)[4]);
  CHECK_FALSE(push_all(DynaInsRemover::Config::paper())[4]);
}

}  // namespace
}  // namespace dynains::test
