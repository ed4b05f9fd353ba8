// People in a crowd hide each other. The dynamic occupancy grid and ignored dynamic returns find
// them.
#include <vector>

#include "support/catch.hpp"
#include "support/drive_of.hpp"
#include "support/simulated_runs.hpp"

namespace dynains::test {
namespace {

const std::vector<simulation::SimulatedScan>& crowd() {
  static const std::vector<simulation::SimulatedScan> scans = [] {
    const simulation::Config config =
        drive_of(simulation::Scene::kCrowd, simulation::Sensor::kOs1_64, 80, 6);
    return simulate(config);
  }();
  return scans;
}
const StaticByVerdict& by_default() {
  static const StaticByVerdict verdicts = static_points(crowd());
  return verdicts;
}

// Without a part of the pipeline, F1 must be lower by `least`, and PR may be higher by at most
// `price`.
struct Gain {
  double least, price;
};
void check_gain(const DynaInsRemover::Config& config, const Gain& final_gain,
                const Gain& newest_gain) {
  const StaticByVerdict without = static_points(crowd(), config);
  const auto check = [](const StaticPoints& with, const StaticPoints& removed, const Gain& gain) {
    const auto a = score(crowd(), with), b = score(crowd(), removed);
    CAPTURE(a.f1(), b.f1(), a.preservation_rate(), b.preservation_rate());
    CHECK(a.f1() > b.f1() + gain.least);
    CHECK(a.preservation_rate() > b.preservation_rate() - gain.price);
  };
  check(by_default().final, without.final, final_gain);
  check(by_default().newest, without.newest, newest_gain);
}

TEST_CASE("the dynamic occupancy grid finds hidden people in both verdicts, at a low cost in PR") {
  DynaInsRemover::Config config;
  config.evidence.dynamic_grid_ratio = 1.0;
  check_gain(config, {0.003, 0.2}, {0.004, 0.2});
}

TEST_CASE("ignored dynamic returns find hidden people in both verdicts, at a low cost in PR") {
  DynaInsRemover::Config config;
  config.evidence.ignore_dynamic_returns = false;
  check_gain(config, {0.006, 0.3}, {0.012, 0.2});
}

}  // namespace
}  // namespace dynains::test
