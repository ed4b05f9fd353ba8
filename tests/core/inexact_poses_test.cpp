// Verdicts under inexact poses, judged by the exact ones.

#include "support/catch.hpp"
#include "support/drive_of.hpp"
#include "support/random.hpp"
#include "support/simulated_runs.hpp"

namespace dynains::test {
namespace {

using simulation::SimulatedScan;

const std::vector<SimulatedScan>& street() {
  static const std::vector<SimulatedScan> scans =
      simulate(drive_of(simulation::Scene::kUrban, simulation::Sensor::kOs1_64, 40, 33));
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
  const evaluation::Score exact = score(street(), judged(street()).final);
  REQUIRE(exact.f1() > 0.95);

  const auto scored = [](const std::vector<SimulatedScan>& scans) {
    return score(street(), judged(scans).final);
  };
  CHECK(scored(with_noise(0.03, 0.1)).f1() == Approx(exact.f1()).margin(0.006));
  const evaluation::Score noisy = scored(with_noise(0.1, 0.3));
  CHECK(noisy.kept() >= 98.5);
  CHECK(noisy.f1() >= 0.93);

  const evaluation::Score jump = scored(with_poses([](std::size_t i, Eigen::Isometry3d T) {
    if (i >= street().size() / 2) T.translation() += Eigen::Vector3d(0.3, 0.4, 0.0);
    return T;
  }));
  CHECK(jump.kept() >= 98.0);
  CHECK(jump.f1() == Approx(exact.f1()).margin(0.006));

  const Eigen::Vector3d first = street().front().T_world_sensor.translation();
  const evaluation::Score drift = scored(with_poses([&](std::size_t, Eigen::Isometry3d T) {
    const double path = (T.translation() - first).norm();
    T.translation() += 0.01 * path * Eigen::Vector3d(0.8, 0.6, 0.1);
    return T;
  }));
  CHECK(drift.f1() == Approx(exact.f1()).margin(0.003));
}

struct Epochs {
  std::vector<std::size_t> scans;  // that begin an epoch, without the first one
  std::vector<std::optional<EpochReason>> reasons;
  double static_share = 0.0;  // of the static points more than 5 scans from scan kJump
};

constexpr std::size_t kJump = 20;

Epochs epochs_of(const std::vector<SimulatedScan>& scans) {
  Epochs epochs;
  DynaInsRemover::Config config;
  config.build_map = false;
  DynaInsRemover remover(config);
  double still = 0.0, kept = 0.0;
  const auto count = [&](const ScanVerdict& verdict) {
    if (verdict.scan + 5 >= kJump && verdict.scan <= kJump + 5) return;
    for (std::size_t i = 0; i < verdict.labels.size(); ++i) {
      const std::uint32_t truth = scans[verdict.scan].labels[i];
      if (verdict.labels[i] == PointLabel::kInvalid || is_moving(truth)) continue;
      still += 1.0;
      kept += is_static(verdict.labels[i]) ? 1.0 : 0.0;
    }
  };
  std::size_t pushed = 0;
  const auto look = [&](const FrameResult& frame) {
    const std::size_t i = pushed++;
    if (!frame.began_epoch || i == 0) return;
    epochs.scans.push_back(i);
    epochs.reasons.push_back(frame.began_epoch);
    CHECK_FALSE(frame.pose_residual);
  };
  push_all(remover, scans, look, count);
  epochs.static_share = kept / still;
  return epochs;
}

TEST_CASE("a pose that jumps begins an epoch, or is corrected") {
  const Eigen::Isometry3d T_sensor = street()[kJump].T_world_sensor;
  const double without = epochs_of(street()).static_share;
  for (const auto& [metres, degrees] : {std::pair(0.3, 0.0),
                                        {1.0, 0.3},
                                        {3.0, 2.0},
                                        {9.0, 0.0},
                                        {20.0, 90.0},
                                        {0.0, 1.0},
                                        {0.0, 5.0},
                                        {0.0, 20.0},
                                        {0.0, 90.0}}) {
    const Eigen::Isometry3d T_jump =
        T_sensor * Eigen::Translation3d(0.6 * metres, 0.8 * metres, 0.0) *
        Eigen::AngleAxisd(degrees * M_PI / 180.0, Eigen::Vector3d::UnitZ()) * T_sensor.inverse();
    const Epochs epochs = epochs_of(with_poses(
        [&](std::size_t i, const Eigen::Isometry3d& T) { return i < kJump ? T : T_jump * T; }));
    INFO(metres << " m, " << degrees << " deg");
    CHECK(epochs.static_share > without - 0.005);
    if (metres < 2.0 && degrees < 2.0) continue;  // may be corrected
    REQUIRE(epochs.scans == std::vector<std::size_t>{kJump});
    CHECK(epochs.reasons.front() == EpochReason::kJump);
  }
}

// An odometry without a motion at first takes the second scan for the place of the first one.
TEST_CASE("a wrong first motion begins one epoch, not all of them") {
  std::vector<SimulatedScan> scans =
      simulate(drive_of(simulation::Scene::kHighway, simulation::Sensor::kHdl64, 12, 71));
  scans.front().T_world_sensor = scans[1].T_world_sensor;
  CHECK(epochs_of(scans).scans == std::vector<std::size_t>{2});
  // A pose that jumps and comes back begins two.
  scans[7].T_world_sensor.translation().x() += 20.0;
  CHECK(epochs_of(scans).scans == std::vector<std::size_t>{2, 7, 8});
}

TEST_CASE("exact poses begin no epoch: sparse sensors, two scans a second, lost scans") {
  using simulation::Scene;
  using simulation::Sensor;
  const auto [scene, sensor] = GENERATE(table<Scene, Sensor>({{Scene::kCrowd, Sensor::kLivox},
                                                              {Scene::kGarage, Sensor::kVlp16},
                                                              {Scene::kHighway, Sensor::kVlp16},
                                                              {Scene::kUrban, Sensor::kLivox}}));
  const std::vector<SimulatedScan> all = simulate(drive_of(scene, sensor, 40, 61));
  std::vector<SimulatedScan> slow, lossy;
  Random random(4);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i % 5 == 0) slow.push_back(all[i]);
    if (random.uniform(0.0, 1.0) > 0.3) lossy.push_back(all[i]);
  }
  CHECK(epochs_of(all).scans.empty());
  CHECK(epochs_of(slow).scans.empty());
  CHECK(epochs_of(lossy).scans.empty());
}

TEST_CASE("a push tells why it begins an epoch") {
  DynaInsRemover::Config config;
  config.build_map = false;
  DynaInsRemover remover(config);
  double time = 0.0;
  const auto push = [&](std::size_t i, double pause, double shift) {
    time += pause;
    const Eigen::Isometry3d T = Eigen::Translation3d(shift, 0.0, 0.0) * street()[i].T_world_sensor;
    return remover.push(points_of(street()[i]), T, time).began_epoch;
  };
  CHECK(push(0, 0.1, 0.0) == EpochReason::kStart);
  CHECK_FALSE(push(1, 0.1, 0.0));
  CHECK(push(2, config.max_gap + 0.1, 0.0) == EpochReason::kPause);
  CHECK(push(3, 0.1, 100.0) == EpochReason::kJump);
  remover.flush([](const ScanVerdict&) {});
  CHECK(push(4, 0.1, 100.0) == EpochReason::kStart);
}

}  // namespace
}  // namespace dynains::test
