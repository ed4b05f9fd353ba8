#include "run.hpp"

#include <cstdint>
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
#include "dynains/recording/second_pass.hpp"
#include "estimate_poses.hpp"
#include "grid/grid_file.hpp"
#include "interrupt.hpp"
#include "log_output.hpp"
#include "run/output/output_folder.hpp"
#include "run/remarks/run_doubts.hpp"
#include "run/remarks/start_check.hpp"
#include "run_plan.hpp"
#include "run_report.hpp"
#include "run_sequence.hpp"
#include "write_grid.hpp"
#include "write_view.hpp"

namespace dynains::run {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSessionField = "/request/session";

/// Tests the first verdicts, if there is a second pass, and makes all results of what is left.
/// After a signal, the first verdicts stay.
void finish_second_pass(const RunPlan& plan, RunResults& results, const RunListener& listener) {
  SecondPass* const pass = results.second_pass();
  if (pass == nullptr) return;
  pass->test([] { return InterruptGuard::signal() == 0; });
  results.revise(plan.settings.config.map,
                 [&](std::size_t done) { listener.revision_progress(done, results.finished()); });
}

/// Threads of the remover: two, if the machine has two cores or the configuration says so.
int remover_threads(const RunPlan& plan) {
  if (plan.settings.outputs.one_thread) return 1;
  return std::thread::hardware_concurrency() > 1 ? 2 : plan.settings.config.threads;
}

/// Processes all scans, or those that come before a signal. Returns the times.
RunTiming process(const RunPlan& plan, const RunListener& listener, RunResults& results) {
  const std::size_t total = plan.range.size();
  DynaInsRemover::Config config = plan.settings.config;
  if (results.second_pass() != nullptr) config.build_map = false;  // the second pass makes the map
  config.threads = remover_threads(plan);
  DynaInsRemover remover(config);
  listener.progress(0, total);
  RunTiming timing =
      run_sequence(remover, plan.sequence, plan.range, results, [&](std::size_t done) {
        listener.progress(done, total);
        return InterruptGuard::signal() == 0;
      });
  finish_second_pass(plan, results, listener);
  return timing;
}

/// The listener, whose warnings are also added to `warnings`. Both must outlive the result.
RunListener with_memory(const RunListener& listener, std::vector<std::string>& warnings) {
  RunListener result = listener;
  result.warn = [&](const std::string& text) {
    warnings.push_back(text);
    listener.warn(text);
  };
  return result;
}

/// Throws IoError if nothing was judged, or nothing is static: the scans are then not what the run
/// takes them for.
void check_not_empty(const RunPlan& plan, const RunResults& results) {
  if (results.finished() < plan.range.size()) return;
  const LabelCounts& labels = results.labels();
  const std::uint64_t kept = labels[PointLabel::kGround] + labels[PointLabel::kStatic];
  const bool is_empty = results.map_points() && *results.map_points() == 0;
  if (kept > 0 && !is_empty) return;
  throw IoError(plan.sequence.folder().string() + ": the map is empty: of " +
                std::to_string(results.points()) + " points, " + std::to_string(kept) +
                " are static, " + std::to_string(labels[PointLabel::kDynamic]) + " moving, " +
                std::to_string(labels[PointLabel::kOutOfRange]) + " out of range and " +
                std::to_string(labels[PointLabel::kInvalid]) +
                " invalid (NaN, infinite or at the origin)");
}

/// Warns if many points, or most of those above the ground, were not judged, if most of the removed
/// ones are ground, and of odd scans.
void warn_of_scans(const RunPlan& plan, const RunResults& results, const RunTiming& timing,
                   const RunListener& listener) {
  const LabelCounts& labels = results.labels();
  const auto warn_above = [&](double share, std::uint64_t part, std::uint64_t whole,
                              const char* text) {
    if (static_cast<double>(part) > share * static_cast<double>(whole))
      listener.warn(std::to_string(100 * part / whole) + " % of the points " + text);
  };
  // Beams without a return are not judged in any recording; those of a box are.
  const bool has_box = !plan.sequence.options().self_boxes.empty();
  const std::uint64_t lost = labels[PointLabel::kInvalid];
  warn_above(0.3, labels[PointLabel::kOutOfRange] + (has_box ? lost : 0),
             results.points() - (has_box ? 0 : lost),
             "are not judged: nearer than --min-range, farther than --max-range, deeper than "
             "--noise-depth, or in --self-box");
  warn_above(0.5, results.unclustered(), labels[PointLabel::kStatic] + labels[PointLabel::kDynamic],
             "above the ground are in no cluster and not judged; see --cluster-range");
  warn_above(0.5, results.below_movers(), labels[PointLabel::kDynamic],
             "that are removed are ground below what moves; see --footprint");
  std::vector<ScanCounts> counts = results.counts();
  for (std::size_t i = 0; i < counts.size(); ++i) {
    counts[i].fits = timing.rows[i].pose_residual.has_value();
  }
  for (const std::string& text :
       remarks_on_odd_scans(plan.sequence, plan.range.first, counts, false)) {
    listener.warn(text);
  }
}

/// Outputs outside of the folder of results.
struct OutsideOutputs {
  /// Files of the results that `out` replaces are replaced, too.
  OutsideOutputs(const RunPlan& plan, const OutputFolder& out) {
    const fs::path& map_file = plan.settings.outputs.map;
    if (plan.settings.outputs.has_outside_map()) {
      map.emplace(map_file, out.owns(map_file), plan.inputs);
    }
    const fs::path& grid_file = plan.settings.outputs.grid;
    if (!grid_file.empty()) {
      const fs::path image = grid_image(grid_file);
      grid.emplace(grid_file, out.owns(grid_file), plan.inputs);
      picture.emplace(image, out.owns(image), plan.inputs);
    }
    const fs::path& log_file = plan.settings.outputs.log;
    if (log_file.empty()) return;
    check_log_output(plan);
    log.emplace(log_file, out.owns(log_file), plan.inputs);
  }

  std::optional<OutputFile> map, log, grid, picture;
};

/// Writes the log of the results in `folder` to `file`.
void write_log(const fs::path& file, const RunPlan& plan, const fs::path& folder,
               const RunListener& listener, RunOutcome& outcome) {
  const std::optional<std::size_t> unjudged = write_log(plan, folder, file);
  if (!unjudged) {
    outcome.complete = false;
    return;
  }
  outcome.log = plan.settings.outputs.log;
  if (*unjudged == 0) return;
  listener.warn(outcome.log.string() + ": " + std::to_string(*unjudged) +
                " clouds have no verdict, for lack of a pose, by their stamps or by --start and "
                "--end; they keep all points");
}

/// Writes the grid of the results in `folder`, unless a signal comes.
void write_grid(const RunPlan& plan, const fs::path& folder, const OutsideOutputs& outside,
                const RunListener& listener, RunOutcome& outcome) {
  std::vector<std::size_t> scans(plan.range.size());
  std::iota(scans.begin(), scans.end(), plan.range.first);
  if (scans.size() == 1) listener.warn(kGridOfOneScan);
  const PlacedGrid made =
      grid_of_run(folder, plan.sequence, scans, plan.settings.outputs.grid_config, false,
                  [](std::size_t) { return InterruptGuard::signal() == 0; });
  if (InterruptGuard::signal() != 0) {
    outcome.complete = false;
    return;
  }
  grid::write_grid(outside.picture->path(), outside.grid->path(), made.grid, made.origin);
  outcome.grid = made.summary();
}

/// Throws ConfigError if the scans disagree with the poses.
void check_before(const RunPlan& plan, const RunListener& listener) {
  const RunSettings& settings = plan.settings;
  check_ranges(plan.sequence, plan.range, settings.config,
               settings.recording_flags.contains("--point-units"));
  const StartCheck start =
      check_start(plan.sequence, plan.range, settings.config, settings.accept_poses);
  for (const std::string& text : start.warnings) listener.warn(text);
  if (!start.refusal.empty()) {
    throw ConfigError(start.refusal + " See: dynains check " + settings.recording_as_given +
                      "; or run with these poses and clouds by --accept-poses");
  }
}

/// Where the files are written that appear at the end.
RunOutputs partial_outputs(const RunPlan& plan, const OutputFolder& out,
                           const OutsideOutputs& outside) {
  RunOutputs outputs = plan.settings.outputs;
  outputs.folder = out.path();
  if (!outputs.map.empty()) {
    outputs.map = outside.map ? outside.map->path() : out.path() / outputs.map.filename();
  }
  return outputs;
}

/// Puts all outputs in place, or keeps what a signal has left.
void publish(const RunPlan& plan, const RunOutputs& outputs, OutputFolder& out,
             OutsideOutputs& outside, SessionWriter* session, RunOutcome& outcome) {
  if (!outcome.complete) {
    outcome.signal = InterruptGuard::signal();
    outcome.outputs.folder = out.path();
    return out.keep_unfinished(outcome.report);
  }
  if (outputs.write_page) {
    outcome.page = plan.settings.outputs.folder / kViewPage;
    write_page(outputs.folder / kViewPage, outputs.folder, plan.sequence, plan.range,
               plan.settings.config.map.map_voxel, kDefaultViewPoints);
  }
  for (const auto* const file : {&outside.map, &outside.log, &outside.grid, &outside.picture}) {
    if (*file) outcome.report["written"][(*file)->listed_target()] = content_of((*file)->path());
  }
  out.finish(outcome.report, [&] {
    if (outside.map) outside.map->put_in_place();
    if (outside.log) outside.log->put_in_place();
    if (outside.grid) outside.picture->put_in_place([&] { outside.grid->put_in_place(); });
    if (session != nullptr) session->commit();
  });
}

/// Writes the results, from the first scan on, or until a signal comes.
RunOutcome write_results(const RunPlan& plan, const RunListener& caller, OutputFolder& out,
                         OutsideOutputs& outside) {
  std::vector<std::string> warnings = plan.sequence.warnings();
  const RunListener listener = with_memory(caller, warnings);
  check_before(plan, listener);
  std::optional<SessionWriter> session;
  std::optional<SessionAlignment> alignment;
  // The results that are replaced may have added the session already.
  const std::string& name = plan.session.info.name;
  const bool has_session =
      (out.earlier_have(kSessionField, name) || out.left_have(kSessionField, name)) &&
      plan.session.is_fulfilled();
  if (!plan.session.city.empty() && !has_session) {
    const SessionRequest request = aligned(plan.session, plan.sequence, plan.range);
    alignment = request.info.alignment;
    session.emplace(City::open_or_make(request.city, request.grid), request.info);
  }

  const InterruptGuard interrupt(listener.second_signal);
  const RunOutputs outputs = partial_outputs(plan, out, outside);
  RunResults results(plan.sequence, plan.range, outputs);
  if (session) results.contribute_to(*session);
  ByteStore store(outputs.folder);
  Returns returns(store, plan.settings.config.evidence);
  std::optional<SecondPass> second_pass;
  // The first pass has compared all scans of a shorter recording.
  if (plan.settings.passes > 1 && plan.range.size() > returns.compared()) {
    SecondPassConfig config;
    config.sensors = plan.settings.config.sensors;
    config.static_policy = plan.settings.static_policy;
    config.evidence = plan.settings.config.evidence;
    results.wait_for(second_pass.emplace(store, config));
  } else {
    results.watch(returns);
  }
  const RunTiming timing = process(plan, listener, results);
  RunOutcome outcome;
  outcome.outputs = plan.settings.outputs;
  outcome.complete = results.is_complete();
  outcome.alignment = alignment;
  check_not_empty(plan, results);
  warn_of_scans(plan, results, timing, listener);
  RunDoubts doubts = find_doubts(plan.sequence, plan.range, timing);
  doubts.returns = return_errors(plan.sequence, plan.range.first,
                                 second_pass ? second_pass->returns() : returns.found());
  for (const std::string& text : sentences(doubts, plan.sequence)) listener.warn(text);
  results.commit();
  write_timing(outputs.folder / "timing.csv", timing);
  if (outputs.write_poses) write_trajectory(outputs.folder / kEstimatedPoses, plan.sequence);
  if (outside.log && outcome.complete) {
    write_log(outside.log->path(), plan, outputs.folder, listener, outcome);
  }
  if (outside.grid && outcome.complete) {
    write_grid(plan, outputs.folder, outside, listener, outcome);
  }
  nlohmann::ordered_json told = to_json(doubts, plan.sequence);
  told["warnings"] = warnings;
  outcome.report = make_report(plan, told, results, timing);
  if (!outcome.grid.is_null()) outcome.report["grid"] = outcome.grid;
  if (second_pass) {
    outcome.report["second_pass"] = {{"places", second_pass->place_count()},
                                     {"removed_points", second_pass->revised().removed},
                                     {"restored_points", second_pass->revised().restored}};
  }
  publish(plan, outputs, out, outside, session ? &*session : nullptr, outcome);
  return outcome;
}

}  // namespace

RunOutcome run(const RunSettings& settings, Recording recording, const RunListener& listener) {
  const RunPlan plan = make_plan(settings, std::move(recording));
  OutputFolder out(plan.settings.outputs.folder, run_output_kind(), plan.listing, settings.force,
                   plan.inputs);
  OutsideOutputs outside(plan, out);
  return write_results(plan, listener, out, outside);
}

}  // namespace dynains::run
