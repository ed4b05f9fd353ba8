#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "command.hpp"
#include "dynains/dyna_ins_remover.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"
#include "dynains/io/diagnosis.hpp"
#include "dynains/io/folder_lock.hpp"
#include "dynains/io/point_file.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/pose.hpp"
#include "evaluation_options.hpp"
#include "interrupt.hpp"
#include "lone_scans.hpp"
#include "map_on_disk.hpp"
#include "naming_scan.hpp"
#include "output_folder.hpp"
#include "progress.hpp"
#include "recording_options.hpp"
#include "remover_options.hpp"
#include "run_report.hpp"
#include "run_request.hpp"
#include "run_results.hpp"
#include "run_sequence.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;
using Config = DynaInsRemover::Config;

/// In the folder of results, while a run with --map-memory lasts.
constexpr const char* kTileFolder = "map_tiles";

struct RunOptions {
  explicit RunOptions(CLI::App& command)
      : sequence(command, "recording"), remover(command, "default") {}

  RecordingFlags sequence;
  std::string out;
  std::string map;
  std::optional<double> map_memory;  // MB
  ScanWindow window;
  bool write_online = false;
  bool write_clean = false;
  bool force = false;
  bool resume = false;
  bool quiet = false;
  RemoverOptions remover;
};

nlohmann::ordered_json to_json(const Config& config) {
  nlohmann::ordered_json json;
  Config::visit(config, [&](const auto& parameter) { json[parameter.name] = parameter.value; });
  return json;
}

ScanRange select_scans(const Recording& sequence, const ScanWindow& window) {
  const auto number = [&](std::size_t i) { return sequence.number(i); };
  ScanRange range{0, sequence.size() - 1};
  while (range.first <= range.last && window.start && number(range.first) < *window.start) {
    ++range.first;
  }
  while (range.last > range.first && window.end && number(range.last) > *window.end) --range.last;
  const bool none = range.first > range.last || (window.end && number(range.last) > *window.end);
  if (none) {
    throw ConfigError("--start and --end leave no scan of " + sequence.name(0) + " to " +
                      sequence.name(sequence.size() - 1));
  }
  return range;
}

/// So that a broken file or pose is noticed before anything is written.
void check_scans(const Recording& sequence, const ScanRange& range) {
  for (std::size_t i = range.first; i <= range.last; ++i) {
    sequence.check_scan(i);
    naming_scan(sequence, i, [&] { validate_pose("T_world_sensor", sequence.T_world_sensor(i)); });
  }
}

/// What an earlier run may have left in `folder`.
OutputFiles files_of_a_run(const fs::path& folder) {
  OutputFiles files;
  files.marker = "report.json";
  files.files = {"timing.csv", "static_map.ply", "dynamic_points.ply"};
  const std::string map = earlier_map(folder);
  if (!map.empty()) files.files.push_back(map);
  files.folders = {"labels", "online", "causes", "clean", kTileFolder};
  files.extensions = {".label", ".cause", ".bin", ".pcd", ".ply", ".tile"};
  return files;
}

RunOutputs make_outputs(const RunOptions& options, const Config& config) {
  RunOutputs outputs;
  outputs.folder = options.out;
  outputs.write_online = options.write_online;
  outputs.write_clean = options.write_clean;
  if (options.map.empty()) {
    if (config.build_map) outputs.map = outputs.folder / "static_map.ply";
    return outputs;
  }
  if (!config.build_map) throw ConfigError("--map needs --build-map true");
  if (!is_point_file(options.map)) {
    throw ConfigError("--map " + options.map + ": expected a name that ends in .ply or .pcd");
  }
  outputs.map = options.map;
  if (whole_path(outputs.map) == whole_path(outputs.folder / "dynamic_points.ply")) {
    throw ConfigError("--map " + options.map + ": the moving points go there");
  }
  return outputs;
}

/// Whether every file of a complete run is still there.
bool is_whole(const RunOutputs& outputs, const Recording& sequence, const ScanRange& range) {
  if (!outputs.map.empty() && !fs::exists(outputs.map)) return false;
  for (const char* name : {"dynamic_points.ply", "timing.csv"}) {
    if (!fs::exists(outputs.folder / name)) return false;
  }
  const auto has = [&](const char* folder, const std::string& file) {
    return fs::exists(outputs.folder / folder / file);
  };
  for (std::size_t i = range.first; i <= range.last; ++i) {
    const std::string& name = sequence.name(i);
    if (!has("labels", name + ".label") || !has("causes", name + ".cause")) return false;
    if (outputs.write_online && !has("online", name + ".label")) return false;
    if (outputs.write_clean && !has("clean", CleanWriter::name(sequence, i))) return false;
  }
  return true;
}

/// Refuses whatever must not be replaced. Throws IoError.
void check_outputs(const RunOutputs& outputs, const OutputFiles& files, const Recording& sequence,
                   bool replace) {
  check_output_folder(outputs.folder, files, replace);
  if (outputs.map.empty()) return;
  const fs::path map = whole_path(outputs.map);
  if (map.parent_path() == whole_path(sequence.scan_folder())) {
    throw IoError(outputs.map.string() + ": the scans are there; choose another folder for --map");
  }
  if (fs::exists(map) && !replace) {
    throw IoError(outputs.map.string() + ": exists; choose another name for --map, or replace it " +
                  "by --force");
  }
  // A map that cannot be written would otherwise be noticed when the old results are gone.
  PointFileWriter attempt(outputs.map);
}

/// Clears the way for new results, once nothing but the points and the disk can go wrong any more.
void prepare(const RunOutputs& outputs, const OutputFiles& files, bool resume,
             const nlohmann::ordered_json& request) {
  nlohmann::ordered_json marker = unfinished_report(outputs.map_name());
  marker["request"] = request;
  if (!outputs.map.empty()) remove_leftovers_of(outputs.map);
  // Files of the same run are replaced one by one: never is less there than before.
  (resume ? mark_output_folder : clear_output_folder)(outputs.folder, files, to_text(marker));
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
  const TimeStatistics time = statistics(std::move(totals));
  const std::uint64_t moving = labels[PointLabel::kDynamic];
  const std::uint64_t kept = labels[PointLabel::kGround] + labels[PointLabel::kStatic];
  std::cout << std::fixed << std::setprecision(2) << results.finished() << " scans, "
            << results.points() << " points: " << percent(moving) << " % moving, " << percent(kept)
            << " % static, " << percent(results.points() - moving - kept) << " % not judged\n"
            << "time per scan: median " << time.median << " ms, p95 " << time.p95 << " ms, max "
            << time.max << " ms\n";
  if (results.map_points()) {
    std::cout << "static map: " << outputs.map.string() << " (" << *results.map_points()
              << " points)\n";
  }
  std::cout << "moving points: " << (outputs.folder / "dynamic_points.ply").string() << " ("
            << moving << " points)\n"
            << "labels: " << (outputs.folder / "labels").string()
            << "\nreport: " << (outputs.folder / "report.json").string() << std::endl;
}

void warn_of_poses(const std::string& sequence, const Agreement& agreement) {
  std::cerr << "dynains: warning: only " << std::lround(100.0 * agreement.share)
            << " % of the points of neighbouring scans agree under these poses; see: dynains check "
            << sequence << std::endl;
}

void run(const RunOptions& options) {
  const Config config = options.remover.config();
  const RunOutputs outputs = make_outputs(options, config);
  std::optional<RemoverWithMapOnDisk::Config> on_disk;
  if (options.map_memory) {
    if (!config.build_map) throw ConfigError("--map-memory needs --build-map true");
    on_disk = with_map_on_disk(config, outputs.folder / kTileFolder, *options.map_memory);
  }
  const Recording sequence = options.sequence.open();
  const ScanRange range = select_scans(sequence, options.window);
  check_scans(sequence, range);
  const nlohmann::ordered_json configuration = to_json(config);
  const nlohmann::ordered_json request =
      describe_request(sequence, range, outputs, on_disk.has_value(), configuration);
  create_folder(outputs.folder);
  const FolderLock lock(outputs.folder);
  const EarlierRun earlier =
      options.resume ? find_earlier_run(outputs.folder, request) : EarlierRun::kNone;
  if (earlier == EarlierRun::kComplete && is_whole(outputs, sequence, range)) {
    if (!options.quiet) std::cout << outputs.folder.string() << ": complete already" << std::endl;
    return;
  }
  const bool resume = earlier != EarlierRun::kNone;
  const OutputFiles files = files_of_a_run(outputs.folder);
  check_outputs(outputs, files, sequence, options.force || resume);
  const PoseAgreement agreement = pose_agreement(sequence, range.first, range.last);
  if (agreement.doubtful()) warn_of_poses(options.sequence.folder(), agreement.as_given);
  if (const auto lone = remark_on_lone_scans(sequence, range.first, range.last, config)) {
    std::cerr << "dynains: warning: " << *lone << std::endl;
  }
  prepare(outputs, files, resume, request);

  RunResults results(sequence, range, outputs);
  const InterruptGuard interrupt;
  RunTiming timing;
  const auto work = [&](auto& remover) {
    Progress progress(range.size(), "scans", options.quiet);
    timing = run_sequence(remover, sequence, range, results, [&](std::size_t done) {
      progress.update(done);
      return InterruptGuard::signal() == 0;
    });
  };
  if (on_disk) {
    RemoverWithMapOnDisk remover(*on_disk);
    remover.reset();  // forgets the tiles of a run that was killed
    work(remover);
    remover.reset();
    std::error_code ignored;
    fs::remove(on_disk->map.map_folder, ignored);
  } else {
    DynaInsRemover remover(config);
    work(remover);
  }
  results.commit();

  RunDescription description;
  description.sequence = options.sequence.folder();
  description.first_scan = sequence.name(range.first);
  description.last_scan = sequence.name(range.first + results.finished() - 1);
  description.missing_poses = sequence.missing_pose_count();
  description.agreement = agreement.as_given;
  description.preset = options.remover.preset_name();
  description.complete = results.finished() == range.size();
  description.map = outputs.map_name();
  description.configuration = configuration;
  if (on_disk) description.configuration["map_memory"] = on_disk->map.map_memory;
  write_timing(outputs.folder / "timing.csv", timing);
  // The report must not claim what a power cut could still take.
  sync_files(outputs.folder);
  nlohmann::ordered_json report = make_report(description, results, timing);
  report["request"] = request;
  write_report(outputs.folder / "report.json", report);
  if (!options.quiet) print_summary(results, timing, outputs);
  if (!description.complete) throw Interrupted{InterruptGuard::signal()};
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
      "replace the results of an earlier run in --out, and the file of --map; results are removed "
      "first, so that old and new files never mix. A folder that holds anything else is refused");
  command
      .add_flag("--resume", options->resume,
                "complete a run with the same flags that was interrupted or killed, if --out holds "
                "one; nothing to do if it is complete. Scans are processed from the first on, for "
                "verdicts depend on earlier scans")
      ->excludes(force);
  add_window_options(command, options->window);
  command
      .add_option("--map", options->map,
                  "static map, .ply or .pcd [static_map.ply in the folder of --out]")
      ->type_name("FILE");
  command
      .add_option(
          "--map-memory", options->map_memory,
          "bounds the memory of the map, for long drives: what is farthest goes to files in "
          "--out until the run is complete [no bound]")
      ->type_name("MB");
  command.add_flag("--write-online", options->write_online,
                   "also write the verdicts without latency, to the folder online");
  command.add_flag("--write-clean", options->write_clean,
                   "also write every scan without its moving points, to the folder clean, in the "
                   "form it has in SEQ");
  command.add_flag("-q,--quiet", options->quiet, "print errors only");
  command.footer(
      "Writes labels/NNNNNN.label (uint32 a point: 251 moving, 9 static, 0 not judged; instance id "
      "above\nthe 16th bit), causes/NNNNNN.cause (uint8 a point: why, see `dynains eval "
      "--errors`), "
      "static_map.ply,\ndynamic_points.ply, report.json and timing.csv. Each file appears whole or "
      "not at all; report.json says\n\"complete\": false until the end. Ctrl-C ends the run after "
      "the scan at hand, writes what is there and exits\nwith 130.");
  command.callback([options] { run(*options); });
}

}  // namespace dynains::program
