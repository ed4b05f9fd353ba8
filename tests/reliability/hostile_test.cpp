// Faulty poses and times: the results are defined, for both presets.

#include "support/catch.hpp"
#include "support/runs.hpp"

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
