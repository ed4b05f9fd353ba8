// Cost of a push by stage, on one thread, in milliseconds. `bench_core [PUSHES [BEAMS]]`, for each
// preset.

#include "dynains/compiled_remover.hpp"
#include "dynains/median.hpp"
#include "support/scene.hpp"

namespace dynains::bench {
namespace {

// Scans on a long lane between pillars with one van, at 10 Hz and 10 m/s; 80 beams measure 95,000
// points.
std::vector<test::Scan> street_scans(int beams) {
  test::Scene scene;
  for (int i = -5; i < 12; ++i) {
    for (const double y : {-14.0, -9.0, 9.0, 14.0}) {
      scene.boxes.push_back({{8.0 * i - 1.0, y - 1.5, 0.0}, {8.0 * i + 1.5, y + 1.0, 4.0}});
    }
  }
  scene.boxes.push_back(test::van(12.0, 3.5, {-6.0, 0.0, 0.0}));
  return test::drive(scene, 16, 10.0, 0.0, beams);
}

using Rows = std::vector<std::pair<std::string, double>>;

// A function that is not inlined, so that callgrind can count it alone (.ci/cost).
[[gnu::noinline]] StageTimes counted_push(DynaInsRemover& remover, const test::Scan& scan,
                                          double time) {
  return remover.push(scan.points, scan.T_world_sensor, time).times;
}

// Medians over the second half of the pushes, back and forth on one lane, so that the map stops
// growing.
Rows measure(const DynaInsRemover::Config& config, const std::vector<test::Scan>& scans,
             std::size_t pushes) {
  DynaInsRemover remover(config);
  std::vector<StageTimes> times;
  for (std::size_t i = 0; i < pushes; ++i) {
    const std::size_t at = i % (2 * scans.size());
    const test::Scan& scan = scans[at < scans.size() ? at : 2 * scans.size() - 1 - at];
    const StageTimes spent = counted_push(remover, scan, 0.1 * static_cast<double>(i));
    if (i >= pushes / 2) times.push_back(spent);
  }
  Rows rows;
  const auto add = [&](const std::string& name, auto&& value) {
    std::vector<double> values;
    values.reserve(times.size());
    for (const StageTimes& spent : times) values.push_back(value(spent));
    rows.emplace_back(name, median(std::move(values)));
  };
  std::vector<std::string> stages;
  StageTimes::visit(times.front(), [&](const char* name, double) { stages.emplace_back(name); });
  for (const std::string& stage : stages) {
    add(stage + ", ms", [&](const StageTimes& spent) {
      double result = 0.0;
      StageTimes::visit(spent, [&](const char* name, double milliseconds) {
        if (stage == name) result = milliseconds;
      });
      return result;
    });
  }
  add("all stages, ms", [](const StageTimes& spent) { return spent.total(); });
  rows.emplace_back("points", static_cast<double>(scans.front().points.size()));
  rows.emplace_back("map, MB", 1e-6 * static_cast<double>(remover.map().memory_bytes()));
  return rows;
}

}  // namespace
}  // namespace dynains::bench

int main(int argc, char** argv) {
  using dynains::DynaInsRemover;
  const std::size_t pushes = argc > 1 ? std::max(1UL, std::stoul(argv[1])) : 96;
  const auto scans = dynains::bench::street_scans(argc > 2 ? std::stoi(argv[2]) : 80);
  const auto standard = dynains::bench::measure(DynaInsRemover::Config(), scans, pushes);
  const auto paper = dynains::bench::measure(DynaInsRemover::Config::paper(), scans, pushes);
  std::printf("%-24s %10s %10s\n", "median of a push", "default", "paper");
  for (std::size_t i = 0; i < paper.size(); ++i) {
    std::printf("%-24s %10.2f %10.2f\n", paper[i].first.c_str(), standard[i].second,
                paper[i].second);
  }
}
