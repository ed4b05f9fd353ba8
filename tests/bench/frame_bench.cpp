// The whole pipeline: cost of a frame.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstddef>
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "support/scene.hpp"

namespace dynains::bench {
namespace {

// Scans of about 110,000 points on a long lane between pillars with one van, at 10 Hz and 10 m/s.
std::vector<test::Scan> street_scans() {
  test::Scene scene;
  for (int i = -5; i < 12; ++i) {
    for (const double y : {-14.0, -9.0, 9.0, 14.0}) {
      scene.boxes.push_back({{8.0 * i - 1.0, y - 1.5, 0.0}, {8.0 * i + 1.5, y + 1.0, 4.0}});
    }
  }
  scene.boxes.push_back(test::van(12.0, 3.5, {-6.0, 0.0, 0.0}));
  return test::drive(scene, 16, 10.0);
}

// Value below which a `share` of the values lies.
double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

// The default configuration, back and forth on one lane, so that the map stops growing.
void BM_DefaultFrame(benchmark::State& state) {
  static const std::vector<test::Scan> scans = street_scans();
  DynaInsRemover remover;
  double time = 0.0;
  std::vector<double> milliseconds;
  for (auto _ : state) {
    for (std::size_t i = 0; i < 2 * scans.size(); ++i) {
      const test::Scan& scan = scans[i < scans.size() ? i : 2 * scans.size() - 1 - i];
      time += 0.1;
      milliseconds.push_back(remover.push(scan.points, scan.T_world_sensor, time).times.total());
    }
  }
  state.counters["median_ms"] = quantile(milliseconds, 0.5);
  state.counters["p99_ms"] = quantile(milliseconds, 0.99);
  state.counters["worst_ms"] = quantile(milliseconds, 1.0);
}
BENCHMARK(BM_DefaultFrame)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dynains::bench
