#include "passes.hpp"

#include <cstdint>
#include <utility>

#include "interrupt.hpp"
#include "read_ahead.hpp"
#include "recorded_scans.hpp"
#include "run_plan.hpp"
#include "run_results.hpp"

namespace dynains::run {

Passes::Passes(const RunPlan& plan, const std::filesystem::path& folder)
    : plan_(plan),
      store_(folder),
      returns_(store_, plan.settings.config.evidence),
      verdicts_(folder) {
  if (plan.settings.passes == 1 || plan.range.size() <= returns_.compared()) return;
  SecondPassConfig config;
  config.sensors = plan.settings.config.sensors;
  config.static_policy = plan.settings.static_policy;
  config.evidence = plan.settings.config.evidence;
  second_.emplace(store_, config);
}

void Passes::add(const JudgedScan& judged) {
  const ScanVerdict& verdict = judged.verdict;
  if (is_one()) {
    returns_.add(judged.points, verdict.labels, verdict.compared);
    return;
  }
  packed_.pack(verdict, plan_.settings.outputs.write_beliefs);
  verdicts_.add(packed_.labels);
  verdicts_.add(packed_.causes);
  verdicts_.add(packed_.beliefs);
  second_->add(judged.points, verdict, judged.scan.sensor);
}

void Passes::finish(RunResults& results, const std::function<void(std::size_t done)>& progress) {
  if (is_one()) return;
  second_->test([] { return InterruptGuard::signal() == 0; });
  const std::size_t first = plan_.range.first, count = results.finished();
  if (count == 0) return;
  progress(0);
  ReadAhead reader(plan_.sequence, first, first + count - 1, results.thread());
  JudgedScan judged;
  for (std::size_t i = 0; i < count; ++i) {
    judged.index = first + i;
    judged.scan = reader.next(std::move(judged.scan));
    copy_points(judged.scan, judged.points);
    verdicts_.read(3 * i, packed_.labels);
    verdicts_.read(3 * i + 1, packed_.causes);
    verdicts_.read(3 * i + 2, packed_.beliefs);
    packed_.unpack(judged.scan, judged.arrays);
    second_->revise(judged.points, static_cast<std::uint32_t>(i), judged.arrays);
    results.take_revised(judged);
    progress(i + 1);
  }
  results.finish();
}

const StaticMapAccumulator::Config& Passes::map_config() const { return plan_.settings.config.map; }

nlohmann::ordered_json Passes::report() const {
  if (is_one()) return nullptr;
  return {{"places", second_->place_count()},
          {"removed_points", second_->revised().removed},
          {"restored_points", second_->revised().restored}};
}

}  // namespace dynains::run
