// People in a crowd hide each other: what passages are for.
#include <vector>

#include "support/catch.hpp"
#include "support/simulated_runs.hpp"

namespace dynains::test {
namespace {

TEST_CASE("passages find people whom others hide, at once and finally, at little cost") {
  simulation::Config crowd;
  crowd.scene = simulation::Scene::kCrowd;
  crowd.sensor = simulation::Sensor::kOs1_64;
  crowd.scans = 80;
  crowd.seed = 6;
  const std::vector<simulation::SimulatedScan> scans = simulate(crowd);
  const StaticByVerdict with = static_points(scans);
  DynaInsRemover::Config config;
  config.evidence.passage_share = 1.0;
  const StaticByVerdict without = static_points(scans, config);

  const auto final = score(scans, with.final), final_without = score(scans, without.final);
  CAPTURE(final.f1(), final_without.f1(), final.preservation_rate(),
          final_without.preservation_rate());
  CHECK(final.f1() > final_without.f1() + 0.004);
  CHECK(final.preservation_rate() > final_without.preservation_rate() - 0.2);
  const auto newest = score(scans, with.newest), newest_without = score(scans, without.newest);
  CAPTURE(newest.f1(), newest_without.f1(), newest.preservation_rate(),
          newest_without.preservation_rate());
  CHECK(newest.f1() > newest_without.f1() + 0.004);
  CHECK(newest.preservation_rate() > newest_without.preservation_rate() - 0.2);
}

}  // namespace
}  // namespace dynains::test
