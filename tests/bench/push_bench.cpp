// Cost of a push by stage, on one thread: milliseconds, and instructions where the system lets a
// program count its own. `bench_core [PUSHES [BEAMS]]`, for each preset.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#if defined(__linux__)
#include <linux/perf_event.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

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

// Counts the instructions of this program, in user space.
class InstructionCounter {
 public:
  InstructionCounter() {
#if defined(__linux__)
    perf_event_attr what = {};
    what.size = sizeof(what);
    what.type = PERF_TYPE_HARDWARE;
    what.config = PERF_COUNT_HW_INSTRUCTIONS;
    what.exclude_kernel = 1;
    what.exclude_hv = 1;
    file_ = static_cast<int>(syscall(SYS_perf_event_open, &what, 0, -1, -1, 0));
#endif
  }

  // Instructions so far; 0 if the system does not count them.
  std::uint64_t count() {
    std::uint64_t result = 0;
#if defined(__linux__)
    if (file_ < 0 || read(file_, &result, sizeof(result)) != sizeof(result)) return 0;
#endif
    return result;
  }

 private:
  [[maybe_unused]] int file_ = -1;  // open until the program ends
};

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
  InstructionCounter instructions;
  DynaInsRemover remover(config);
  std::vector<StageTimes> times;
  std::vector<double> millions;
  for (std::size_t i = 0; i < pushes; ++i) {
    const std::size_t at = i % (2 * scans.size());
    const test::Scan& scan = scans[at < scans.size() ? at : 2 * scans.size() - 1 - at];
    const std::uint64_t before = instructions.count();
    const StageTimes spent = counted_push(remover, scan, 0.1 * static_cast<double>(i));
    const std::uint64_t after = instructions.count();
    if (i < pushes / 2) continue;
    times.push_back(spent);
    millions.push_back(1e-6 * static_cast<double>(after - before));
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
  const double counted = median(std::move(millions));
  if (counted > 0.0) rows.emplace_back("instructions, millions", counted);
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
