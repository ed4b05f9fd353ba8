// Faulty poses and times: the results are defined, for both presets.
#include <algorithm>
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "support/catch.hpp"
#include "support/runs.hpp"
#include "support/scene.hpp"

namespace dynains::test {
namespace {

using Config = DynaInsRemover::Config;

double dynamic_share(const std::vector<Scan>& scans, const Run& result) {
  return share(scans, result.final, PointLabel::kDynamic).value();
}

TEST_CASE("a pose that jumps within the scene at an impossible speed removes nothing") {
  Config config = GENERATE(Config::paper(), Config());
  std::vector<Scan> scans = drive(yard(), 10, 5.0);
  for (std::size_t i = 5; i < scans.size(); ++i) {
    scans[i].T_world_sensor.pretranslate(Eigen::Vector3d(12.0, -4.0, 0.0));
  }
  CHECK(dynamic_share(scans, run(config, scans)) < 1e-3);
  // With a higher max_speed and without a check of poses, the jump counts as motion and removes
  // points: the test can fail.
  config.max_speed = 1000.0;
  if (config.decision == Decision::kFreeSpace)
    CHECK(dynamic_share(scans, run(config, scans)) < 1e-3);
  config.evidence.pose_tolerance = 0.0;
  CHECK(dynamic_share(scans, run(config, scans)) > 5e-3);
}

TEST_CASE("a repeated scan shows no motion and adds nothing to the map") {
  const Config config = GENERATE(Config::paper(), Config());
  const std::vector<Scan> once = {oncoming().scan(sensor_at(0.0), 0.0)};
  std::vector<Scan> again(12, once[0]);
  for (std::size_t i = 0; i < again.size(); ++i) again[i].time = 0.1 * static_cast<double>(i);
  DynaInsRemover first(config);
  DynaInsRemover remover(config);
  run(first, once);
  const Run result = run(remover, again);
  CHECK(dynamic_share(again, result) == 0.0);
  CHECK(remover.map().size() == first.map().size());
}

TEST_CASE("standing still for two minutes removes nothing, and the map stops growing") {
  const Config config = GENERATE(Config::paper(), Config());
  // Two scans per second: the noise of ten scans, repeated.
  const std::vector<Scan> scans = drive(yard(), 10, 0.0);
  DynaInsRemover remover(config);
  std::size_t moving = 0;
  std::size_t points = 0;
  const auto count = [&](const ScanVerdict& verdict) {
    points += verdict.labels.size();
    moving += static_cast<std::size_t>(
        std::count(verdict.labels.begin(), verdict.labels.end(), PointLabel::kDynamic));
  };
  std::size_t map_in_the_middle = 0;
  for (std::size_t i = 0; i < 240; ++i) {
    const Scan& scan = scans[i % scans.size()];
    const FrameResult frame =
        remover.push(scan.points, scan.T_world_sensor, 0.5 * static_cast<double>(i));
    if (frame.finished) count(*frame.finished);
    if (i == 120) map_in_the_middle = remover.map().size();
  }
  remover.flush(count);
  REQUIRE(points > 15000000);
  CHECK(static_cast<double>(moving) < 1e-4 * static_cast<double>(points));
  CHECK(map_in_the_middle > 10000);
  CHECK(remover.map().size() <= map_in_the_middle + map_in_the_middle / 1000);
}

TEST_CASE("with every third scan dropped, moving objects are removed and static ones stay") {
  const Config config = GENERATE(Config::paper(), Config());
  std::vector<Scan> scans;
  for (int i = 0; i < 13; ++i) {
    if (i % 3 == 1) continue;
    scans.push_back(oncoming().scan(sensor_at(0.5 * i), 0.1 * i));
  }
  const std::vector<Verdict> verdicts = run(config, scans).final;
  const Share moving = share(scans, verdicts, PointLabel::kDynamic, kAddedBox);
  REQUIRE(moving.total > 5000);
  CHECK(moving.value() > 0.7);
  const Share all = share(scans, verdicts, PointLabel::kDynamic);
  CHECK(all.labelled - moving.labelled < all.total / 200);
}

}  // namespace
}  // namespace dynains::test
