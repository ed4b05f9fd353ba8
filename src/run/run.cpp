#include "run.hpp"

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <numeric>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "dynains/city/city.hpp"
#include "dynains/city/session_writer.hpp"
#include "dynains/compiled_remover.hpp"
#include "dynains/errors.hpp"
#include "estimate_poses.hpp"
#include "interrupt.hpp"
#include "log_output.hpp"
#include "recorded_scans.hpp"
#include "run/output/output_folder.hpp"
#include "run/remarks/cloud_remarks.hpp"
#include "run/remarks/recording_check.hpp"
#include "run/remarks/run_doubts.hpp"
#include "run_plan.hpp"
#include "run_report.hpp"
#include "run_results.hpp"
#include "verdict_files.hpp"
#include "write_grid.hpp"
#include "write_view.hpp"

namespace dynains::run {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// Threads of the remover: two, if the machine has two cores or the configuration says so.
int remover_threads(const RunPlan& plan) {
  if (plan.settings.outputs.one_thread) return 1;
  return std::thread::hardware_concurrency() > 1 ? 2 : plan.settings.config.threads;
}

/// Pushes a scan, and adds its times.
FrameResult push_timed(DynaInsRemover& remover, const Recording& recording, std::size_t i,
                       const RecordedScan& scan, RunTiming& timing) {
  const Clock::time_point begin = Clock::now();
  const FrameResult frame = push_scan(remover, recording, i, scan);
  timing.rows.push_back({recording.name(i), scan.size(), frame.times, ms_since(begin),
                         frame.began_epoch, frame.plausibility, recording.time(i)});
  if (const auto& residual = frame.pose_residual)
    timing.rows.back().pose_residual.emplace(residual->translation, residual->rotation);
  for (const std::uint8_t sensor : scan.sensor) ++timing.sensor_points[sensor];
  return frame;
}

/// Hands the verdicts out that are open after the last scan.
template <class TakeFinal>
void flush_timed(DynaInsRemover& remover, TakeFinal&& take_final, RunTiming& timing) {
  double writing = 0.0;
  const Clock::time_point begin = Clock::now();
  remover.flush([&](const ScanVerdict& verdict) {
    const Clock::time_point begin_writing = Clock::now();
    take_final(verdict);
    writing += ms_since(begin_writing);
  });
  timing.flush = ms_since(begin) - writing;
  timing.pipeline = timing.flush;
  for (const TimingRow& row : timing.rows) timing.pipeline += row.total;
}

/// Pushes all scans, or those that come before a signal, and passes every verdict, and at the end
/// the map, to `results`. Scans wait in memory for their final verdict, unless they are many and a
/// second reading is a plain copy of their file (.bin).
RunTiming process(const RunPlan& plan, const RunListener& listener, RunResults& results) {
  const Recording& recording = plan.sequence;
  const ScanRange& range = plan.range;
  DynaInsRemover::Config config = plan.settings.config;
  config.build_map = config.build_map && !results.has_second_pass();
  config.threads = remover_threads(plan);
  DynaInsRemover remover(config);
  RunTiming timing;
  ReadAhead reader(recording, range.first, range.last, plan.settings.outputs.thread());
  const bool are_kept = remover.latency() <= 8 || recording.format() != ScanFormat::kBin;
  std::deque<RecordedScan> kept;  // oldest first; the last one is the pushed scan
  RecordedScan spare;
  const auto take_oldest = [&] {
    spare = std::move(kept.front());
    kept.pop_front();
  };
  const auto take_final = [&](const ScanVerdict& verdict) {
    if (are_kept) take_oldest();
    results.take_final(are_kept ? &spare : nullptr, verdict);
  };
  listener.progress(0, range.size());
  for (std::size_t i = range.first; i <= range.last; ++i) {
    if (!are_kept && !kept.empty()) take_oldest();
    const RecordedScan& scan = kept.emplace_back(reader.next(std::exchange(spare, {})));
    const FrameResult frame = push_timed(remover, recording, i, scan, timing);
    results.take_newest(frame);
    if (frame.finished) take_final(*frame.finished);
    listener.progress(timing.rows.size(), range.size());
    if (InterruptGuard::signal() != 0) break;
  }
  flush_timed(remover, take_final, timing);
  results.finish();
  if (results.map_points()) {
    remover.map().for_each([&](const Eigen::Vector3d& point) { results.add_map_point(point); });
  }
  return timing;
}

/// Throws IoError if nothing was judged, or nothing is static: the scans are then not what the run
/// takes them for.
void check_not_empty(const RunPlan& plan, const RunResults& results) {
  if (results.finished() < plan.range.size()) return;
  const Tally& labels = results.tally();
  const std::uint64_t kept = labels[PointLabel::kGround] + labels[PointLabel::kStatic];
  const bool is_empty = results.map_points() && *results.map_points() == 0;
  if (kept > 0 && !is_empty) return;
  throw IoError(plan.sequence.folder().string() + ": the map is empty: of " +
                std::to_string(labels.points) + " points, " + std::to_string(kept) +
                " are static, " + std::to_string(labels[PointLabel::kDynamic]) + " moving, " +
                std::to_string(labels[PointLabel::kOutOfRange]) + " out of range and " +
                std::to_string(labels[PointLabel::kInvalid]) +
                " invalid (NaN, infinite or at the origin)");
}

/// Warns if many points, or most of those above the ground, were not judged, if most of the removed
/// ones are ground, and of odd scans.
void warn_of_scans(const RunPlan& plan, const RunResults& results, const RunTiming& timing,
                   const Warn& warn) {
  const Tally& labels = results.tally();
  const auto warn_above = [&](double share, std::uint64_t part, std::uint64_t whole,
                              const char* text) {
    if (static_cast<double>(part) > share * static_cast<double>(whole))
      warn(std::to_string(100 * part / whole) + " % of the points " + text);
  };
  // Beams without a return are not judged in any recording; those of a box are.
  const bool has_box = !plan.sequence.options().self_boxes.empty();
  const std::uint64_t lost = labels[PointLabel::kInvalid];
  warn_above(0.3, labels[PointLabel::kOutOfRange] + (has_box ? lost : 0),
             labels.points - (has_box ? 0 : lost),
             "are not judged: nearer than --min-range, farther than --max-range, deeper than "
             "--noise-depth, or in --self-box");
  warn_above(0.5, labels.unclustered, labels[PointLabel::kStatic] + labels[PointLabel::kDynamic],
             "above the ground are in no cluster and not judged; see --cluster-range");
  warn_above(0.5, labels.below_movers, labels[PointLabel::kDynamic],
             "that are removed are ground below what moves; see --footprint");
  std::vector<ScanCounts> counts = labels.scans;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    counts[i].fits = timing.rows[i].pose_residual.has_value();
  }
  for (const std::string& text :
       remarks_on_odd_scans(plan.sequence, plan.range.first, counts, false)) {
    warn(text);
  }
}

/// Whether the run adds a session: the results that are replaced may have added it already.
bool adds_session(const RunPlan& plan, const OutputFolder& out) {
  if (plan.session.city.empty()) return false;
  return !out.had("/request/session", plan.session.info.name) || !plan.session.is_fulfilled();
}

/// Writes the grid. Returns PlacedGrid::summary(). Throws Interrupted.
nlohmann::ordered_json write_grid(const RunOutputs& outputs, const RunPlan& plan,
                                  const PointStore& labels, const Warn& warn) {
  std::vector<std::size_t> scans(plan.range.size());
  std::iota(scans.begin(), scans.end(), plan.range.first);
  const PlacedGrid made = grid_of_run(
      [&](std::size_t i, const RecordedScan&, std::vector<PointLabel>& of_scan) {
        labels.read(i - plan.range.first, of_scan);
      },
      plan.sequence, scans, outputs.grid_config, false, [](std::size_t) {});
  for (const std::string& doubt : made.doubts) warn(doubt);
  grid::write_grid(outputs.grid_image, outputs.grid, made.grid, made.origin);
  return made.summary();
}

/// Throws ConfigError if the scans disagree with the poses.
void check_before(const RunPlan& plan, const Warn& warn) {
  const RunSettings& settings = plan.settings;
  check_ranges(plan.sequence, plan.range, settings.config,
               settings.recording_flags.contains("--point-units"));
  const StartCheck start =
      check_start(plan.sequence, plan.range, settings.config, settings.accept_poses);
  for (const std::string& text : start.warnings) warn(text);
  if (!start.refusal.empty()) {
    throw ConfigError(start.refusal + " See: dynains check " + settings.recording_as_given +
                      "; or run with these poses and clouds by --accept-poses");
  }
}

/// With the places where the files are written that appear at the end.
RunSettings begin_outputs(const RunPlan& plan, OutputFolder& out) {
  RunSettings settings = plan.settings;
  RunOutputs& outputs = settings.outputs;
  const auto begin = [&](fs::path& file) {
    if (!file.empty()) file = out.add(file, plan.inputs);
  };
  if (outputs.has_outside_map()) {
    begin(outputs.map);
  } else if (!outputs.map.empty()) {
    outputs.map = out.path() / outputs.map.filename();
  }
  if (!outputs.log.empty()) check_log_output(plan);
  begin(outputs.log);
  begin(outputs.grid);
  begin(outputs.grid_image);
  outputs.folder = out.path();
  return settings;
}

/// Writes the results, from the first scan on, or until a signal comes.
RunOutcome write_results(const RunPlan& plan, const RunSettings& settings,
                         const RunListener& listener, OutputFolder& out) {
  std::vector<std::string> warnings = plan.sequence.warnings();
  const Warn warn = [&](const std::string& text) {
    warnings.push_back(text);
    listener.warn(text);
  };
  check_before(plan, warn);
  RunOutcome outcome;
  outcome.outputs = plan.settings.outputs;
  std::optional<SessionWriter> session;
  if (adds_session(plan, out)) {
    const SessionRequest request = aligned(plan.session, plan.sequence, plan.range);
    outcome.alignment = request.info.alignment;
    session.emplace(City::open_or_make(request.city, request.grid), request.info);
  }

  const RunOutputs& outputs = settings.outputs;
  std::optional<viewer::Page> page;
  PointStore labels(outputs.folder);  // final ones, for what reads the recording again
  RunResults results(plan.sequence, plan.range, settings);
  if (session) {
    results.add(
        [&](const JudgedScan& judged) {
          session->add(judged.points, judged.verdict.labels, judged.truth,
                       judged.verdict.T_world_sensor, static_cast<std::uint32_t>(judged.index));
        },
        true);
  }
  if (outputs.write_page) {
    page.emplace(make_page(plan.sequence, plan.range, settings.config.map.map_voxel));
    results.add([&](const JudgedScan& judged) { add_to_page(plan.sequence, judged, *page); }, true);
  }
  if (!outputs.log.empty() || !outputs.grid.empty()) {
    results.add([&](const JudgedScan& judged) { labels.add(judged.arrays.labels); });
  }
  const RunTiming timing = process(plan, listener, results);
  results.revise([&](std::size_t done) { listener.revision_progress(done, results.finished()); });

  check_not_empty(plan, results);
  warn_of_scans(plan, results, timing, warn);
  const RunDoubts doubts =
      find_doubts(plan.sequence, plan.range, timing,
                  return_errors(plan.sequence, plan.range.first, results.returns()));
  for (const std::string& text : doubts.sentences) warn(text);
  results.commit();
  write_timing(outputs.folder / "timing.csv", timing);
  if (outputs.write_poses) write_trajectory(outputs.folder / kResultNames.poses, plan.sequence);
  bool is_complete = results.finished() == plan.range.size() && results.is_revised();
  nlohmann::ordered_json grid;
  try {
    if (is_complete && !outputs.log.empty()) write_log(plan, labels, outputs.log, warn);
    if (is_complete && !outputs.grid.empty()) grid = write_grid(outputs, plan, labels, warn);
  } catch (const Interrupted&) {
    is_complete = false;
  }
  nlohmann::ordered_json remarks = doubts.json;
  remarks["warnings"] = warnings;
  outcome.report = make_report(plan, remarks, results, timing);
  if (!grid.is_null()) outcome.report["grid"] = grid;
  if (results.has_second_pass()) outcome.report["second_pass"] = results.second_pass_report();
  if (!is_complete) {
    outcome.signal = InterruptGuard::signal();
    outcome.outputs.folder = out.path();
    out.keep_unfinished(outcome.report);
    return outcome;
  }
  if (page) write_page(*page, outputs.folder / kResultNames.page);
  out.finish(outcome.report, [&] {
    if (session) session->commit();
  });
  return outcome;
}

}  // namespace

RunOutcome run(const RunSettings& settings, Recording recording, const RunListener& listener) {
  const RunPlan plan = make_plan(settings, std::move(recording));
  const InterruptGuard interrupt(listener.second_signal);
  OutputFolder out(plan.settings.outputs.folder, kRunOutput, plan.listing, settings.force,
                   plan.inputs);
  return write_results(plan, begin_outputs(plan, out), listener, out);
}

}  // namespace dynains::run
