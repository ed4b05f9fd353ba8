#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "command.hpp"
#include "dynains/io/diagnosis.hpp"
#include "dynains/remover.hpp"
#include "evaluation_options.hpp"
#include "interrupt.hpp"
#include "lone_scans.hpp"
#include "output_folder.hpp"
#include "progress.hpp"
#include "run_plan.hpp"
#include "run_report.hpp"
#include "run_results.hpp"
#include "run_sequence.hpp"
#include "view_command.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;

/// Processes all scans, or those that come before a signal. Returns the times.
RunTiming process(const RunPlan& plan, const RunOptions& options, const fs::path& folder,
                  RunResults& results) {
  RunTiming timing;
  const auto work = [&](auto& remover) {
    Progress progress(plan.range.size(), "scans", options.quiet);
    timing = run_sequence(remover, plan.sequence, plan.range, results, [&](std::size_t done) {
      progress.update(done);
      return InterruptGuard::signal() == 0;
    });
  };
  if (plan.map_on_disk) {
    RemoverWithMapOnDisk::Config config = *plan.map_on_disk;
    config.map.map_folder = folder / kTileFolder;
    RemoverWithMapOnDisk remover(config);
    work(remover);
    remover.reset();
    std::error_code ignored;
    fs::remove(config.map.map_folder, ignored);
  } else {
    DynaInsRemover remover(plan.config);
    work(remover);
  }
  return timing;
}

void print_summary(const RunResults& results, const RunTiming& timing, const RunOutputs& outputs) {
  const LabelCounts& labels = results.labels();
  const auto percent = [&](std::uint64_t count) {
    return results.points() == 0
               ? 0.0
               : 100.0 * static_cast<double>(count) / static_cast<double>(results.points());
  };
  std::vector<double> totals;
  for (const TimingRow& row : timing.rows) totals.push_back(row.total);
  const Statistics time = statistics(std::move(totals));
  const std::uint64_t moving = labels[PointLabel::kDynamic];
  const std::uint64_t kept = labels[PointLabel::kGround] + labels[PointLabel::kStatic];
  std::cout << std::fixed << std::setprecision(2) << results.finished() << " scans, "
            << results.points() << " points: " << percent(moving) << " % moving, " << percent(kept)
            << " % static, " << percent(results.points() - moving - kept) << " % not judged\n"
            << "time per scan: median " << time.median << " ms, p95 " << time.p95 << " ms, max "
            << time.max << " ms\n";
  if (results.map_points()) {
    std::cout << "static map: " << (outputs.folder / outputs.map_name()).string() << " ("
              << *results.map_points() << " points)\n";
  }
  std::cout << "moving points: " << (outputs.folder / "dynamic_points.ply").string() << " ("
            << moving << " points)\n"
            << "labels: " << (outputs.folder / "labels").string()
            << "\npicture: " << (outputs.folder / kOverviewPicture).string()
            << "\nreport: " << (outputs.folder / "report.json").string() << std::endl;
}

/// Throws ConfigError if the scans disagree with the poses beyond doubt, unless they are accepted.
/// Warns if it is not beyond doubt.
void judge_poses(const RunPlan& plan, const RunOptions& options, const Agreement& agreement) {
  const std::string share = std::to_string(std::lround(100.0 * agreement.share)) +
                            " % of the points of neighbouring scans agree under these poses";
  constexpr std::size_t kFewestScans = 8;  // for a judgement beyond doubt
  if (!options.accept_poses && plan.range.size() >= kFewestScans) {
    const Diagnosis diagnosis = diagnose(plan.sequence);
    // A shift changes little: some broken scans can make one look better.
    const bool is_shift = diagnosis.verdict == PoseVerdict::kOtherwise &&
                          diagnosis.convention.shift != plan.sequence.convention().shift;
    if (!diagnosis.sound() && diagnosis.verdict != PoseVerdict::kUnknown && !is_shift) {
      throw ConfigError("only " + share + ". " + advice(diagnosis) + " See: dynains check " +
                        options.sequence.as_given() +
                        "; or run with these poses by --accept-poses");
    }
  }
  std::cerr << "dynains: warning: only " << share << "; see: dynains check "
            << options.sequence.as_given() << std::endl;
}

void warn_of_doubts(const RunPlan& plan, const RunOptions& options,
                    const PoseAgreement& agreement) {
  if (agreement.doubtful()) judge_poses(plan, options, agreement.as_given);
  const auto lone =
      remark_on_lone_scans(plan.sequence, plan.range.first, plan.range.last, plan.config);
  if (lone) std::cerr << "dynains: warning: " << *lone << std::endl;
}

RunDescription describe(const RunPlan& plan, const RunOptions& options,
                        const PoseAgreement& agreement, const RunResults& results) {
  const Recording& sequence = plan.sequence;
  RunDescription description;
  description.sequence = options.sequence.folder();
  description.sequence_flags = options.sequence.given_flags();
  description.first_scan = sequence.name(plan.range.first);
  description.last_scan = sequence.name(plan.range.first + results.finished() - 1);
  description.missing_poses = sequence.missing_pose_count();
  description.log_ends_early = sequence.early_end().has_value();
  description.agreement = agreement.as_given;
  description.preset = options.remover.preset_name();
  description.complete = results.finished() == plan.range.size();
  description.map = plan.outputs.map_name();
  description.configuration = plan.configuration;
  if (plan.map_on_disk) {
    description.configuration["map_memory"] = plan.map_on_disk->map.map_memory;
  }
  return description;
}

/// Writes the results into `out`, from the first scan on, or until a signal comes.
void write_results(const RunPlan& plan, const RunOptions& options, OutputFolder& out,
                   OutputChange::Mode mode, OutsideMap& outside_map) {
  const PoseAgreement agreement = pose_agreement(plan.sequence, plan.range.first, plan.range.last);
  warn_of_doubts(plan, options, agreement);

  const InterruptGuard interrupt;
  nlohmann::ordered_json marker = unfinished_report(plan.outputs.map_name());
  marker["request"] = plan.request;
  OutputChange change(out, mode, marker, plan.listing);
  if (!change.is_staged()) out.remove_folder_results(kTileFolder);
  RunOutputs outputs = plan.outputs;
  outputs.folder = change.folder();
  RunResults results(plan.sequence, plan.range, outputs, outside_map.take_writer());
  const RunTiming timing = process(plan, options, outputs.folder, results);
  const RunDescription description = describe(plan, options, agreement, results);
  if (change.is_staged() && !description.complete) {
    std::cerr << "dynains: interrupted; the earlier results in " << out.path().string()
              << " stay as they were" << std::endl;
    throw Interrupted{InterruptGuard::signal()};
  }
  results.commit();
  write_timing(outputs.folder / "timing.csv", timing);
  change.put_in_place([&] { results.commit_outside_map(); });
  nlohmann::ordered_json report = make_report(description, results, timing);
  report["request"] = plan.request;
  change.finish(report, plan.outputs.listing(plan.sequence, plan.range, false));
  if (!options.quiet) print_summary(results, timing, plan.outputs);
  if (!description.complete) throw Interrupted{InterruptGuard::signal()};
}

/// The page of a complete run.
void write_page(const RunPlan& plan, const RunOptions& options, OutputFolder& out) {
  const fs::path page = write_view(out, plan.sequence, kDefaultViewPoints);
  if (!options.quiet) std::cout << "page: " << page.string() << std::endl;
}

void run(const RunOptions& options) {
  const RunPlan plan = make_plan(options);
  const LockedFolder lock(plan.outputs.folder);
  OutputFolder out(Folder(plan.outputs.folder), run_output_kind());
  const RunTask task = choose_task(plan, options, out);
  if (task == RunTask::kNothing) {
    out.discard_staging();
    if (!options.quiet) std::cout << out.path().string() << ": complete already" << std::endl;
    if (options.view) write_page(plan, options, out);
    return;
  }
  out.check(plan.listing, plan.inputs);
  if (task == RunTask::kReplace) check_space(plan);
  OutsideMap outside_map(plan, options.force || out.has_results());
  write_results(
      plan, options, out,
      task == RunTask::kReplace ? OutputChange::Mode::kStaged : OutputChange::Mode::kInPlace,
      outside_map);
  if (options.view) write_page(plan, options, out);
}

}  // namespace

void add_run_command(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("run", "Remove what moves from a recorded sequence");
  auto options = std::make_shared<RunOptions>(command);
  command
      .add_option("-o,--out", options->out,
                  "folder for the results; created, must be empty (see --force)")
      ->required()
      ->type_name("FOLDER");
  CLI::Option* const force = command.add_flag(
      "--force", options->force,
      "replace the results of an earlier run in --out, and the file of --map, when the new ones "
      "are "
      "complete: until then the earlier ones stay. A folder without results is refused");
  command
      .add_flag("--resume", options->resume,
                "complete a run with the same flags that was interrupted or killed, if --out holds "
                "one; nothing to do if it is complete. Scans are processed from the first on, for "
                "verdicts depend on earlier scans")
      ->excludes(force);
  add_window_options(command, options->window);
  command
      .add_option("--map", options->map,
                  "static map, .ply, .pcd or .las [static_map.ply in the folder of --out]")
      ->type_name("FILE");
  const char* const kOutputs = "More outputs, and memory";
  command
      .add_flag("--map-attributes", options->map_attributes,
                "the map holds intensity, time and label of its points, as far as scans have "
                "them; a map of LAS holds its attributes always")
      ->group(kOutputs);
  command
      .add_option("--crs", options->crs,
                  "coordinate reference system of the poses, for a map of LAS [none]")
      ->type_name("EPSG:N")
      ->group(kOutputs);
  command
      .add_option(
          "--map-memory", options->map_memory,
          "bounds the memory of the map, for long drives: what is farthest goes to files in "
          "--out until the run is complete [no bound]")
      ->type_name("MB")
      ->group(kOutputs);
  const auto add_output = [&](const char* flag, bool& value, const char* help) {
    command.add_flag(flag, value, help)->group(kOutputs);
  };
  add_output("--write-online", options->write_online,
             "also write the verdicts without latency, to the folder online");
  add_output("--write-clean", options->write_clean,
             "also write every scan without its moving points, to the folder clean, in the form it "
             "has in SEQ");
  add_output("--write-beliefs", options->write_beliefs,
             "also write the probability that a point moves, to the folder beliefs");
  add_output("--write-mcap", options->write_mcap,
             "also write verdicts.mcap, a log of ROS 2 with all scans, their labels, instances, "
             "beliefs and causes, the poses and the map");
  command.add_flag("--view", options->view,
                   "also write the page view.html, which shows the results (see `dynains view`), "
                   "and the folder beliefs");
  command.add_flag(
      "--accept-poses", options->accept_poses,
      "run even if the scans disagree with the poses, which else ends the command with "
      "exit code 2 before anything is written");
  command.add_flag("-q,--quiet", options->quiet, "print errors only");
  command.footer(
      "Writes labels/NNNNNN.label (uint32 a point: 251 moving, 9 static, 0 not judged; instance id "
      "above\nthe 16th bit), causes/NNNNNN.cause (uint8 a point: why, see `dynains eval "
      "--errors`), "
      "static_map.ply,\ndynamic_points.ply, overview.png (before, after, removed), report.json and "
      "timing.csv. Each file appears whole or "
      "not at all; report.json says\n\"complete\": false until the end. Ctrl-C ends the run after "
      "the scan at hand, writes what is there and exits\nwith 130. Other exit codes: 0; 1 if a "
      "file "
      "cannot be read or written; 2 for wrong flags, refused outputs and\nposes that the scans "
      "disagree with.");
  command.callback([options] { run(*options); });
}

}  // namespace dynains::program
