// Both sides of each bound of plausibility, and its result on simulated drives.

#include "dynains/pipeline/plausibility_check.hpp"
#include "support/catch.hpp"
#include "support/drive_of.hpp"
#include "support/simulated_runs.hpp"

namespace dynains::test {
namespace {

using detail::PlausibilityCheck;

constexpr detail::PlausibilityBounds kBounds = PlausibilityCheck::kBounds;

constexpr std::size_t kWindow = 10;  // scans

PlausibilityCheck::Scan usual_scan() {
  PlausibilityCheck::Scan scan;
  scan.points = 1000;
  scan.judged = 900;
  scan.surfaces = {10000, 100, 10000, 100};
  scan.residual = 0.0;
  return scan;
}

/// The result after `count` scans like `scan`.
Plausibility after(std::size_t count, PlausibilityCheck::Scan scan) {
  PlausibilityCheck check;
  Plausibility result;
  for (std::size_t i = 0; i < count; ++i) {
    scan.scan = i;
    result = check.add(scan);
  }
  return result;
}

Suspicion judged(const PlausibilityCheck::Scan& scan) { return after(kWindow, scan).suspicion; }

TEST_CASE("a usual window is plausible, and each share has a bound") {
  CHECK(judged(usual_scan()) == Suspicion::kNone);

  PlausibilityCheck::Scan scan = usual_scan();
  scan.judged = 21;
  CHECK(judged(scan) == Suspicion::kNone);
  scan.judged = 19;
  CHECK(judged(scan) == Suspicion::kUnits);

  const auto with_shares = [](double ground, double instances) {
    PlausibilityCheck::Scan free = usual_scan();
    free.surfaces.ground_free = static_cast<std::uint64_t>(10000.0 * ground / (1.0 - ground));
    free.surfaces.instances_free = static_cast<std::uint64_t>(10000.0 * instances);
    return free;
  };
  constexpr double kStep = 0.01;
  CHECK(judged(with_shares(kBounds.ground_free - kStep, 0.0)) == Suspicion::kNone);
  CHECK(judged(with_shares(kBounds.ground_free + kStep, 0.0)) == Suspicion::kRays);
  CHECK(judged(with_shares(0.0, kBounds.instance_free - kStep)) == Suspicion::kNone);
  CHECK(judged(with_shares(0.0, kBounds.instance_free + kStep)) == Suspicion::kRays);
  const double ground = kBounds.both_ground_free, instances = kBounds.both_instance_free;
  CHECK(judged(with_shares(ground + kStep, instances - kStep)) == Suspicion::kNone);
  CHECK(judged(with_shares(ground - kStep, instances + kStep)) == Suspicion::kNone);
  CHECK(judged(with_shares(ground + kStep, instances + kStep)) == Suspicion::kRays);

  scan = usual_scan();
  scan.residual = kBounds.residual - 0.01F;
  CHECK(judged(scan) == Suspicion::kNone);
  scan.residual = kBounds.residual + 0.01F;
  CHECK(judged(scan) == Suspicion::kPoses);
}

TEST_CASE("one jump is plausible, scans that begin anew again and again are not") {
  PlausibilityCheck check;
  PlausibilityCheck::Scan scan = usual_scan();
  std::vector<Suspicion> told;
  for (std::size_t i = 0; i < 40; ++i) {
    scan.scan = i;
    scan.residual = i == 11 ? 2.0 : 0.0;
    scan.is_misfit = i == 12 || (i > 25 && i % 2 == 0);
    told.push_back(check.add(scan).suspicion);
  }
  CHECK(told[20] == Suspicion::kNone);  // one corrected jump, of any size
  CHECK(told[25] == Suspicion::kNone);
  CHECK(told[39] == Suspicion::kPoses);
}

TEST_CASE("ground that one scan of a window contradicts is plausible, by two it is not") {
  const auto with_shocks = [](std::uint64_t shocks) {
    PlausibilityCheck check;
    Plausibility result;
    for (std::size_t i = 0; i < kWindow; ++i) {
      PlausibilityCheck::Scan scan = usual_scan();
      scan.scan = i;
      scan.surfaces.instances_free = 3000;
      if (i >= 4 && i < 4 + shocks) scan.surfaces.ground_free = 90000;
      result = check.add(scan);
    }
    return result.suspicion;
  };
  CHECK(with_shocks(1) == Suspicion::kNone);
  CHECK(with_shocks(2) == Suspicion::kRays);
}

TEST_CASE("shares of too few samples tell nothing, and neither does less than a window") {
  PlausibilityCheck::Scan scan = usual_scan();
  scan.surfaces = {5, 20, 40, 36};
  CHECK(judged(scan) == Suspicion::kNone);
  scan = usual_scan();
  scan.surfaces.ground_free = 10000;
  CHECK(after(kWindow - 1, scan).suspicion == Suspicion::kNone);
  const Plausibility whole = after(kWindow + 3, scan);
  CHECK(whole.suspicion == Suspicion::kRays);
  CHECK(whole.since == 0);
}

TEST_CASE("right poses of a drive are plausible, inverse and turned ones are not") {
  const std::vector<simulation::SimulatedScan> scans =
      simulate(drive_of(simulation::Scene::kUrban, simulation::Sensor::kVlp16, 30, 12));
  const auto first_doubt = [&](auto&& pose_of) {
    DynaInsRemover remover;
    for (const simulation::SimulatedScan& scan : scans) {
      const FrameResult frame =
          remover.push(points_of(scan), pose_of(scan.T_world_sensor), scan.time);
      if (frame.plausibility.suspicion != Suspicion::kNone) return frame.plausibility.suspicion;
    }
    return Suspicion::kNone;
  };
  CHECK(first_doubt([](const Pose& T) { return T; }) == Suspicion::kNone);
  CHECK(first_doubt([](const Pose& T) { return Pose(T.inverse()); }) != Suspicion::kNone);
  const Pose T_sensor_body(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()));
  CHECK(first_doubt([&](const Pose& T) { return Pose(T * T_sensor_body); }) != Suspicion::kNone);
}

}  // namespace
}  // namespace dynains::test
