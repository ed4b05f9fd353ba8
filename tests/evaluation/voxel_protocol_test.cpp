#include "evaluation/voxel_protocol.hpp"

#include "reference.hpp"
#include "scenes.hpp"
#include "support/catch.hpp"

namespace dynains::evaluation::testing {
namespace {

EvaluationConfig settings(double voxel, double min_range = 0, double max_range = 0,
                          Unlabeled unlabeled = Unlabeled::kIgnore) {
  return {voxel, min_range, max_range, 0, 0.05, TruthClasses(unlabeled)};
}

VoxelProtocol run(const std::vector<OwnedScan>& scans, const EvaluationConfig& with,
                  std::size_t estimates) {
  VoxelProtocol protocol(with, estimates);
  for (const OwnedScan& scan : scans) protocol.add(scan.view());
  for (const OwnedScan& scan : scans) protocol.resolve(scan.view());
  return protocol;
}

Score estimate_score(const std::vector<OwnedScan>& scans, double voxel = 1.0) {
  return run(scans, settings(voxel), 1).score(kFirstEstimate);
}

std::vector<VoxelPoint> map_of(const VoxelProtocol& protocol, std::size_t row) {
  std::vector<VoxelPoint> points;
  protocol.for_each(row, [&](const VoxelPoint& point) { points.push_back(point); });
  return points;
}

}  // namespace

TEST_CASE("PR and RR count voxel points of the raw map") {
  // Four static voxels, one of them removed; two dynamic voxels, one of them kept.
  OwnedScan scan;
  scan.add(0.5F, 0.5F, 0.5F, kRoad, 1);
  scan.add(0.6F, 0.5F, 0.5F, kRoad, 1);  // same voxel: counts once
  scan.add(2.5F, 0.5F, 0.5F, kRoad, 1);
  scan.add(4.5F, 0.5F, 0.5F, kRoad, 1);
  scan.add(6.5F, 0.5F, 0.5F, kRoad, 0);
  scan.add(8.5F, 0.5F, 0.5F, kMovingCar, 0);
  scan.add(10.5F, 0.5F, 0.5F, kMovingCar, 1);
  const Score score = estimate_score({scan});
  CHECK(score.static_total == 4);
  CHECK(score.dynamic_total == 2);
  CHECK(score.kept() == Approx(75.0));
  CHECK(score.removed() == Approx(50.0));
  CHECK(score.f1() == Approx(0.6));  // 2 * 75 * 50 / 125
}

TEST_CASE("The radius is sqrt(3) / 2 of an edge, exclusive") {
  // sqrt(3) / 2 = 0.8660; voxels [0, 1) and [1, 2).
  const auto preserved = [](float kept) {
    OwnedScan scan;
    scan.add(0.25F, 0.5F, 0.5F, kRoad, 0);
    scan.add(kept, 0.5F, 0.5F, kRoad, 1);
    return estimate_score({scan}).static_kept;
  };
  CHECK(preserved(1.115F) == 2);  // 0.865 apart
  CHECK(preserved(1.117F) == 1);  // 0.867 apart
}

TEST_CASE("Ranges are planar and inclusive, and are measured in the sensor frame") {
  OwnedScan scan;
  scan.T_world_sensor.translation().x() = 1000;
  scan.add(2.6F, 0.0F, 9.0F, kRoad, 1);   // too near, however high
  scan.add(2.75F, 0.0F, 0.0F, kRoad, 1);  // in
  scan.add(0.0F, 50.0F, 0.0F, kRoad, 1);  // in, at the limit
  scan.add(0.0F, 50.1F, 0.0F, kRoad, 1);  // too far
  CHECK(run({scan}, settings(0.01, 2.7, 50), 1).score(0).static_total == 2);
}

TEST_CASE("Ranges are those from the sensor of a point") {
  OwnedScan scan;
  scan.add(5.0F, 0.0F, 0.0F, kRoad, 1);   // too near its sensor
  scan.add(1.0F, 0.0F, 0.0F, kRoad, 1);   // in
  scan.add(51.0F, 0.0F, 0.0F, kRoad, 1);  // in
  const std::vector<std::uint8_t> sensors = {1, 1, 1};
  const std::vector<Eigen::Vector3d> origins = {{0.0, 0.0, 0.0}, {4.0, 0.0, 1.0}};
  VoxelProtocol protocol(settings(0.01, 2.7, 50), 1);
  LabelledScan view = scan.view();
  view.sensors = sensors.data();
  view.origins = origins;
  protocol.add(view);
  protocol.resolve(view);
  CHECK(protocol.score(0).static_total == 2);
}

TEST_CASE("Streaming gives the score of the simple reference implementation", "[reference]") {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const auto scans = mixed_scans(seed, 6, 900);
    for (const Unlabeled unlabeled : {Unlabeled::kIgnore, Unlabeled::kStatic}) {
      const auto with = settings(0.2, 0.8, 2.9, unlabeled);
      const VoxelProtocol protocol = run(scans, with, 2);
      const std::vector<Chosen> rows = {
          [](const OwnedScan&, std::size_t, Truth) { return true; },
          [](const OwnedScan&, std::size_t, Truth truth) { return truth == Truth::kStatic; },
          [](const OwnedScan& scan, std::size_t i, Truth) { return (scan.in_map[i] & 1U) != 0; },
          [](const OwnedScan& scan, std::size_t i, Truth) { return (scan.in_map[i] & 2U) != 0; }};
      const auto raw = reference_map(scans, with, rows[0]);
      REQUIRE(raw.size() > 500);
      for (std::size_t row = 0; row < rows.size(); ++row) {
        const auto estimate = reference_map(scans, with, rows[row]);
        CHECK(map_of(protocol, row).size() == estimate.size());
        CHECK(same(protocol.score(row), reference_score(raw, estimate, with.voxel)));
      }
      // The scene is hard enough to detect a wrong rule.
      const Score score = protocol.score(kFirstEstimate);
      CHECK(score.kept() < 95);
      CHECK(score.removed() < 95);
    }
  }
}

TEST_CASE("Coordinates far from the origin do not change the score") {
  auto scans = mixed_scans(11, 4, 600);
  const Score here = run(scans, settings(0.25), 2).score(2);
  // Multiples of the edge that are exact in binary, so that the same points share voxels.
  for (OwnedScan& scan : scans) {
    scan.T_world_sensor.pretranslate(Eigen::Vector3d(500000.0, 5400000.0, 256.0));
  }
  const Score there = run(scans, settings(0.25), 2).score(2);
  CHECK(same(here, there));
}

TEST_CASE("Shares of zero points are not numbers") {
  const VoxelProtocol nothing = run({}, settings(0.2), 1);
  CHECK(std::isnan(nothing.score(0).kept()));
  CHECK(std::isnan(nothing.score(0).f1()));

  OwnedScan bad;
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInf = std::numeric_limits<float>::infinity();
  bad.add(kNan, 5.0F, 0.0F, kRoad, 1);
  bad.add(5.0F, 5.0F, kInf, kRoad, 1);
  bad.add(0.0F, 0.0F, 0.0F, kRoad, 1);
  bad.add(1e30F, 0.0F, 0.0F, kRoad, 1);  // outside the range of the grid
  CHECK(run({bad}, settings(0.2), 1).score(0).static_total == 0);
}

TEST_CASE("The grid ends 2^20 voxels from the first pose, one voxel at either end is free") {
  const auto total = [](float x) {
    OwnedScan scan;
    scan.add(x, 0.5F, 0.5F, kRoad, 1);
    return run({scan}, settings(1.0), 1).score(0).static_total;
  };
  CHECK(total(1048574.5F) == 1);
  CHECK(total(1048575.5F) == 0);
  CHECK(total(-1048574.5F) == 1);
  CHECK(total(-1048575.5F) == 0);
}

}  // namespace dynains::evaluation::testing
