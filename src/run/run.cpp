#include "run.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "dynains/errors.hpp"
#include "dynains/map/static_map_accumulator.hpp"
#include "dynains/recording/second_pass.hpp"
#include "estimate_poses.hpp"
#include "interrupt.hpp"
#include "log_output.hpp"
#include "output_folder.hpp"
#include "range_check.hpp"
#include "run_doubts.hpp"
#include "run_plan.hpp"
#include "run_request.hpp"
#include "run_sequence.hpp"
#include "scratch_file.hpp"
#include "start_check.hpp"
#include "write_view.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;

/// Tests the first verdicts, if there is a second pass, and makes all results of what is left.
/// After a signal, the first verdicts stay.
void finish_second_pass(const RunPlan& plan, RunResults& results, const RunListener& listener) {
  SecondPass* const pass = results.second_pass();
  if (pass == nullptr) return;
  pass->test([] { return InterruptGuard::signal() == 0; });
  StaticMapAccumulator map(plan.config.map);
  const auto add_to_map = [&](PointsView points, Span<const std::uint8_t> keep, const Pose& T) {
    map.insert(points, keep, T);
  };
  results.revise(add_to_map, [&](std::size_t done) {
    if (listener.revision_progress) listener.revision_progress(done, results.finished());
  });
  if (!results.map_points()) return;
  map.for_each([&](const Eigen::Vector3d& point) { results.add_map_point(point); });
}

/// Threads of the remover: two, if the machine has two cores or the configuration says so.
int remover_threads(const RunPlan& plan) {
  if (plan.outputs.thread != std::launch::async) return 1;
  return std::thread::hardware_concurrency() > 1 ? 2 : plan.config.threads;
}

/// Processes all scans, or those that come before a signal. Returns the times.
RunTiming process(const RunPlan& plan, const RunListener& listener, RunResults& results) {
  const std::size_t total = plan.range.size();
  const auto report_progress = [&](std::size_t done) {
    if (listener.progress) listener.progress(done, total);
  };
  DynaInsRemover::Config config = plan.config;
  if (results.second_pass() != nullptr) config.build_map = false;  // the second pass makes the map
  config.threads = remover_threads(plan);
  DynaInsRemover remover(config);
  report_progress(0);
  RunTiming timing =
      run_sequence(remover, plan.sequence, plan.range, results, [&](std::size_t done) {
        report_progress(done);
        return InterruptGuard::signal() == 0;
      });
  finish_second_pass(plan, results, listener);
  return timing;
}

void warn(const RunListener& listener, const std::string& text) {
  if (listener.warn) listener.warn(text);
}

/// The listener, whose warnings are also added to `warnings`. Both must outlive the result.
RunListener with_memory(const RunListener& listener, std::vector<std::string>& warnings) {
  RunListener result = listener;
  result.warn = [&](const std::string& text) {
    warnings.push_back(text);
    warn(listener, text);
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

RunDescription describe(const RunPlan& plan, const RunSettings& settings,
                        const PoseAgreement& agreement, const RunResults& results) {
  const Recording& sequence = plan.sequence;
  RunDescription description;
  description.sequence = settings.recording;
  description.sequence_flags = settings.recording_flags;
  description.first_scan = sequence.name(plan.range.first);
  // Without a finished scan: the first one.
  description.last_scan =
      sequence.name(plan.range.first + std::max<std::size_t>(results.finished(), 1) - 1);
  description.missing_poses = sequence.missing_pose_count();
  description.log_ends_early = sequence.early_end().has_value();
  description.agreement = agreement.as_given;
  description.preset = settings.preset;
  description.complete = results.is_complete();
  description.map = plan.outputs.map_name();
  description.configuration = plan.configuration;
  return description;
}

RunOutcome outcome_of(const RunPlan& plan, const RunResults& results, const RunTiming& timing) {
  RunOutcome outcome;
  outcome.outputs = plan.outputs;
  outcome.complete = results.is_complete();
  outcome.scans = results.finished();
  outcome.points = results.points();
  outcome.labels = results.labels();
  outcome.map_points = results.map_points();
  std::vector<double> totals;
  for (const TimingRow& row : timing.rows) totals.push_back(row.total);
  outcome.time = statistics(std::move(totals));
  return outcome;
}

/// Objects that came or went, with the scans that measured them and those that passed them.
nlohmann::ordered_json to_json(const SecondPass& pass, const RunPlan& plan) {
  const auto name = [&](std::uint32_t scan) { return plan.sequence.name(plan.range.first + scan); };
  const auto metres = [](const Eigen::Vector3d& v) {
    return std::vector<double>{v.x(), v.y(), v.z()};
  };
  auto objects = nlohmann::ordered_json::array();
  for (const SecondPass::Object& object : pass.objects()) {
    if (object.points == 0) continue;
    objects.push_back({{"lowest", metres(object.lowest)},
                       {"highest", metres(object.highest)},
                       {"points", object.points},
                       {"measured", {name(object.first_measured), name(object.last_measured)}},
                       {"passed", {name(object.first_passed), name(object.last_passed)}}});
  }
  return {{"places", pass.place_count()},
          {"removed_points", pass.removed()},
          {"restored_points", pass.restored()},
          {"objects", std::move(objects)}};
}

/// Writes the log of complete results.
void write_log(const LogOutput& log, const RunPlan& plan, const RunListener& listener,
               RunOutcome& outcome) {
  const InterruptGuard interrupt(listener.second_signal);
  const std::optional<std::size_t> unjudged = log.write(plan.outputs.folder);
  if (!unjudged) {
    outcome.complete = false;
    outcome.signal = InterruptGuard::signal();
    warn(listener, plan.outputs.log.string() + ": not written; the other results are complete");
    return;
  }
  outcome.log = plan.outputs.log;
  if (*unjudged == 0) return;
  warn(listener, outcome.log.string() + ": " + std::to_string(*unjudged) +
                     " clouds have no verdict, for lack of a pose, by their stamps or by --start "
                     "and --end; they keep all points");
}

/// Report of a run that is not finished.
nlohmann::ordered_json marker_of(const RunPlan& plan) {
  nlohmann::ordered_json marker = unfinished_report(plan.outputs.map_name());
  marker["request"] = plan.request;
  return marker;
}

/// Writes the results into `out`, from the first scan on, or until a signal comes.
RunOutcome write_results(const RunPlan& plan, const RunSettings& settings,
                         const RunListener& caller, OutputFolder& out, OutputChange::Mode mode,
                         OutsideMap& outside_map) {
  std::vector<std::string> warnings = plan.sequence.warnings();
  const RunListener listener = with_memory(caller, warnings);
  check_ranges(plan.sequence, plan.range, plan.config,
               settings.recording_flags.contains("--point-units"));
  const StartCheck start = check_start(plan.sequence, plan.range, plan.config,
                                       settings.accept_poses, settings.recording_as_given);
  for (const std::string& text : start.warnings) warn(listener, text);
  if (!start.refusal.empty()) {
    throw ConfigError(start.refusal + " See: dynains check " + settings.recording_as_given +
                      "; or run with these poses and clouds by --accept-poses");
  }

  std::optional<SessionContribution> session;
  std::optional<SessionAlignment> alignment;
  // A run that is resumed may have added its session already.
  if (!plan.session.city.empty() && !(settings.resume && plan.session.is_fulfilled())) {
    const SessionRequest request = aligned(plan.session, plan.sequence, plan.range);
    alignment = request.info.alignment;
    session.emplace(request);
  }

  const InterruptGuard interrupt(listener.second_signal);
  OutputChange change(out, mode, marker_of(plan), plan.listing);
  RunOutputs outputs = plan.outputs;
  outputs.folder = change.folder();
  RunResults results(plan.sequence, plan.range, outputs, outside_map.take_writer());
  if (session) results.contribute_to(*session);
  std::optional<ScratchFile> store;
  std::optional<SecondPass> second_pass;
  if (plan.passes > 1) {
    SecondPassConfig config;
    config.static_policy = plan.static_policy;
    config.threads = outputs.thread == std::launch::async ? 2 : 1;
    results.wait_for(second_pass.emplace(store.emplace(outputs.folder), config));
  }
  const RunTiming timing = process(plan, listener, results);
  RunOutcome outcome = outcome_of(plan, results, timing);
  outcome.alignment = alignment;
  check_not_empty(plan, results);
  if (!outcome.complete) outcome.signal = InterruptGuard::signal();
  if (change.is_staged() && !outcome.complete) {
    outcome.earlier_results_stay = true;
    return outcome;
  }
  const RunDoubts doubts = find_doubts(plan.sequence, plan.range, timing);
  for (const std::string& text : sentences(doubts, plan.sequence)) warn(listener, text);
  results.commit();
  write_timing(outputs.folder / "timing.csv", timing);
  if (outputs.write_poses) write_trajectory(outputs.folder / kEstimatedPoses, plan.sequence);
  change.put_in_place([&] {
    results.commit_outside_map();
    if (session && outcome.complete) session->commit();
  });
  outcome.map_points = results.map_points();
  outcome.wall = wall_time(ms_since(settings.started), timing);
  RunDescription description = describe(plan, settings, start.agreement, results);
  description.wall = outcome.wall;
  description.doubts = to_json(doubts, plan.sequence);
  description.doubts["warnings"] = warnings;
  nlohmann::ordered_json report = make_report(description, results, timing);
  report["request"] = plan.request;
  if (second_pass) report["second_pass"] = to_json(*second_pass, plan);
  change.finish(report, plan.listing);
  return outcome;
}

}  // namespace

RunOutcome run(const RunSettings& settings, Recording recording, const RunListener& listener) {
  const RunPlan plan = make_plan(settings, std::move(recording));
  const LockedFolder lock(plan.outputs.folder);
  OutputFolder out(Folder(plan.outputs.folder), run_output_kind());
  const RunTask task = choose_task(plan, settings, out);
  std::optional<LogOutput> log;
  if (!plan.outputs.log.empty()) log.emplace(plan, settings.force || out.has_results());
  RunOutcome outcome;
  if (task == RunTask::kNothing) {
    out.discard_staging();
    out.remove_temporaries();
    outcome.outputs = plan.outputs;
    outcome.was_complete_before = true;
  } else {
    out.check(plan.listing, plan.inputs);
    if (task == RunTask::kReplace) check_space(plan);
    OutsideMap outside_map(plan, settings.force || out.has_results());
    outcome = write_results(
        plan, settings, listener, out,
        task == RunTask::kReplace ? OutputChange::Mode::kStaged : OutputChange::Mode::kInPlace,
        outside_map);
  }
  if (log && outcome.complete && !(outcome.was_complete_before && fs::exists(plan.outputs.log))) {
    write_log(*log, plan, listener, outcome);
  }
  if (settings.view && outcome.complete) {
    outcome.page = write_view(out, plan.sequence, kDefaultViewPoints);
  }
  return outcome;
}

}  // namespace dynains::program
