#include <iostream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "command.hpp"
#include "dynains/errors.hpp"
#include "dynains/evaluation/evaluate.hpp"
#include "dynains/io/point_file.hpp"
#include "parameter_flags.hpp"
#include "program.hpp"
#include "run/labelled_sequence.hpp"
#include "run/output/output_folder.hpp"
#include "run/write_view.hpp"

namespace dynains::program {
namespace {

using evaluation::EvaluationConfig;

struct EvalOptions {
  explicit EvalOptions(CLI::App& command) : sequence(command, "labelled sequence") {
    add_protocol(command);
    command.add_option("runs", runs, "output folders of `dynains run`");
    command
        .add_option("--map", maps,
                    "map file to judge (PLY or PCD, world frame of the poses); can be repeated")
        ->allow_extra_args(false);
    ScanWindow::visit(window, SettingFlags{command});
    command.add_flag("--online", online, "judge the zero-latency labels, OUT/online");
    command.add_flag(
        "--errors", errors,
        "also report where the first run is wrong: by class, instance, range and cause");
    command.add_flag("--unfinished", unfinished,
                     "also judge runs, and maps of runs, whose report.json says \"complete\": "
                     "false");
    command.add_option("--json", json, "write everything to this file, errors included");
    command.add_option("--csv", csv, "write the table to this file");
    command.add_flag("--force", force, "replace the files of --json and --csv");
  }

  EvaluationConfig config() const {
    EvaluationConfig config = protocol;
    if (max_range_option->count() > 0) config.max_range = config.point_max_range = max_range;
    config.truth =
        evaluation::TruthClasses(classes, value_of_name<evaluation::Unlabeled>(unlabeled).value());
    config.validate();
    return config;
  }

  RecordingFlags sequence;
  std::vector<std::string> runs;
  std::vector<std::string> maps;
  ScanWindow window;
  EvaluationConfig protocol;  // without what follows
  double max_range = 0;
  CLI::Option* max_range_option;
  std::string classes = evaluation::TruthClasses().dynamic_classes();
  std::string unlabeled = "ignore";
  bool online = false;
  bool errors = false;
  bool unfinished = false;
  bool force = false;
  std::string json;
  std::string csv;

 private:
  void add_protocol(CLI::App& command) {
    EvaluationConfig::visit(protocol, [&](const auto& parameter) {
      const std::string name = flag_name(parameter.name);
      if (name == "max-range" || name == "point-max-range") return;
      command.add_option("--" + name, parameter.value, std::string(parameter.help) + " [m]")
          ->capture_default_str();
    });
    max_range_option = command.add_option(
        "--max-range", max_range,
        "points at a larger planar range are not judged, 0 = no limit [m] (PR and RR: 0; SA, DA "
        "and error analysis: 50)");
    command
        .add_option("--classes", classes,
                    "dynamic class ids of the ground truth, for example 252-257,259")
        ->capture_default_str();
    command
        .add_option("--unlabeled", unlabeled,
                    "points of class 0 and 1: ignore them, or count them as static as the "
                    "published tables do")
        ->check(CLI::IsMember({"ignore", "static"}))
        ->capture_default_str();
  }
};

InputFiles inputs_of(const EvalOptions& options, const Recording& recording) {
  InputFiles inputs(recording);
  for (const std::string& map : options.maps) inputs.add(map);
  for (const std::string& run : options.runs) inputs.add_results(run);
  return inputs;
}

void eval(const EvalOptions& options) {
  const EvaluationConfig config = options.config();
  if (options.runs.size() > evaluation::kMaxEstimates) {
    throw ConfigError("at most " + std::to_string(evaluation::kMaxEstimates) +
                      " runs can be evaluated at once, not " + std::to_string(options.runs.size()));
  }

  if (!options.unfinished) {
    for (const std::string& folder : options.runs) check_run_is_finished(folder);
    for (const std::filesystem::path map : options.maps) check_run_is_finished(map.parent_path());
  }
  std::vector<VerdictFiles> runs;
  std::vector<std::string> names;
  for (const std::string& folder : options.runs) {
    runs.emplace_back(folder, options.online ? "online" : "labels");
    names.push_back(options.runs.size() > 1 ? folder : options.online ? "online" : "run");
  }

  Recording recording = options.sequence.open();
  if (!options.json.empty() && !options.csv.empty() &&
      whole_path(options.json) == whole_path(options.csv)) {
    throw ConfigError("--json and --csv name one file: " + options.json);
  }
  const InputFiles inputs = inputs_of(options, recording);
  // Opening files shows beforehand whether they can be written.
  std::optional<OutputFile> json, csv;
  const Existing existing = existing_by(options.force);
  if (!options.json.empty()) json.emplace(options.json, existing, inputs);
  if (!options.csv.empty()) csv.emplace(options.csv, existing, inputs);
  LabelledSequence sequence(std::move(recording), options.window, runs);
  if (sequence.missing_truths() > 0) {
    print_warning(std::to_string(sequence.missing_truths()) + " of " +
                  std::to_string(sequence.missing_truths() + sequence.size()) +
                  " scans have no ground truth and are not judged");
  }

  std::vector<PointFile> map_files;
  std::vector<evaluation::MapEstimate> maps;
  for (const std::string& path : options.maps) map_files.push_back(read_points(path));
  for (std::size_t m = 0; m < map_files.size(); ++m) {
    // Maps of several runs mostly have one name.
    const std::string name = map_files.size() > 1
                                 ? options.maps[m]
                                 : std::filesystem::path(options.maps[m]).filename().string();
    maps.push_back({name, map_files[m].positions});
  }

  const auto source = [&](std::size_t i, evaluation::LabelledScan& scan) {
    return sequence.read(i, scan);
  };
  const evaluation::Evaluation result = evaluation::evaluate(source, names, maps, config);

  std::cout << evaluation::to_table(result);
  if (options.errors) std::cout << '\n' << evaluation::errors_to_table(result);
  if (json) json->write([&](std::ostream& out) { out << evaluation::to_json(result); });
  if (csv) csv->write([&](std::ostream& out) { out << evaluation::to_csv(result); });
}

}  // namespace

void add_eval_command(CLI::App& app) {
  add_command<EvalOptions>(
      app, "eval",
      "Judge runs or maps of any tool by a labelled sequence: PR, RR, F1 and SA, DA, AA, HA", "",
      eval);
}

}  // namespace dynains::program
