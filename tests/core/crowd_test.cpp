// People in a crowd hide each other: what passages are for.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/simulation/simulator.hpp"
#include "support/catch.hpp"
#include "support/remover.hpp"

namespace dynains::test {
namespace {

using simulation::SimulatedScan;

std::vector<SimulatedScan> crowd() {
  simulation::Config config;
  config.scene = simulation::Scene::kCrowd;
  config.sensor = simulation::Sensor::kOs1_64;
  config.scans = 50;
  config.seed = 6;
  simulation::Simulator simulator(config);
  std::vector<SimulatedScan> scans;
  for (std::size_t i = 0; i < simulator.size(); ++i) scans.push_back(simulator.scan(i));
  return scans;
}

// Points within 50 m that are wrong, by what they are.
struct Errors {
  std::size_t movers_kept = 0;
  std::size_t others_removed = 0;

  void add(const SimulatedScan& scan, Span<const PointLabel> labels) {
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const float x = scan.xyzi[4 * i], y = scan.xyzi[4 * i + 1];
      const std::uint32_t truth = scan.labels[i] & 0xFFFFU;
      if (truth == 0 || !(x * x + y * y < 50.0F * 50.0F)) continue;
      const bool moves = truth >= 252;
      movers_kept += moves && is_static(labels[i]) ? 1 : 0;
      others_removed += !moves && labels[i] == PointLabel::kDynamic ? 1 : 0;
    }
  }
};

struct Result {
  Errors newest, final;
};

Result run(const std::vector<SimulatedScan>& scans, double passage_share) {
  DynaInsRemover::Config config;
  config.evidence.passage_share = passage_share;
  DynaInsRemover remover(config);
  Result result;
  const auto finish = [&](const ScanVerdict& verdict) {
    result.final.add(scans.at(verdict.scan), verdict.labels);
  };
  for (const SimulatedScan& scan : scans) {
    const RawPoints<float> points{scan.xyzi.data(), scan.xyzi.size() / 4, 4};
    const FrameResult frame = remover.push(points, scan.T_world_sensor, scan.time);
    result.newest.add(scan, frame.newest.labels);
    if (frame.finished) finish(*frame.finished);
  }
  remover.flush(finish);
  return result;
}

TEST_CASE("passages find people whom others hide, at once and finally, at little cost") {
  const std::vector<SimulatedScan> scans = crowd();
  const Result without = run(scans, 1.0);
  const Result with = run(scans, DynaInsRemover::Config().evidence.passage_share);
  CAPTURE(without.final.movers_kept, with.final.movers_kept, without.final.others_removed,
          with.final.others_removed);
  CAPTURE(without.newest.movers_kept, with.newest.movers_kept, without.newest.others_removed,
          with.newest.others_removed);
  const auto is_less = [](std::size_t now, std::size_t before) { return 100 * now < 97 * before; };
  CHECK(is_less(with.final.movers_kept, without.final.movers_kept));
  CHECK(is_less(with.newest.movers_kept, without.newest.movers_kept));
  const auto gained = without.final.movers_kept - with.final.movers_kept;
  CHECK(with.final.others_removed - without.final.others_removed < gained);
}

}  // namespace
}  // namespace dynains::test
