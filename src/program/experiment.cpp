// The paper's experiments, each a subcommand of `dynains experiment`.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <iostream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "command.hpp"
#include "dynains/compiled_remover.hpp"
#include "dynains/errors.hpp"
#include "dynains/evaluation/report.hpp"
#include "dynains/io/recording.hpp"
#include "parameter_flags.hpp"
#include "progress.hpp"
#include "run/labelled_sequence.hpp"
#include "run/output/output_folder.hpp"
#include "run/recorded_scans.hpp"
#include "run/run_report.hpp"
#include "run/run_timing.hpp"
#include "shared_options.hpp"
#include "variants.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;
using evaluation::csv_field;
using evaluation::EvaluationRow;
using evaluation::format_number;

// Table I of the paper: its own and quoted scores on SemanticKITTI.
struct PublishedRow {
  const char* sequence;
  const char* method;
  double pr;  ///< %
  double rr;  ///< %
  double f1;
};

struct PublishedWindow {
  const char* sequence;
  std::size_t start;  ///< scan numbers, inclusive
  std::size_t end;
};

constexpr std::array<PublishedWindow, 5> kPublishedWindows = {
    {{"00", 4390, 4530}, {"01", 150, 250}, {"02", 860, 950}, {"05", 2350, 2670}, {"07", 630, 820}}};

constexpr std::array<PublishedRow, 30> kPublishedRows = {{
    {"00", "OctoMap", 34.568, 99.979, 0.514},
    {"00", "Removert", 85.502, 99.354, 0.919},
    {"00", "ERASOR", 93.980, 97.081, 0.955},
    {"00", "DynamicFilter", 90.070, 91.090, 0.906},
    {"00", "paper, IOC only", 97.973, 97.540, 0.977},
    {"00", "paper, full", 98.067, 96.679, 0.974},
    {"01", "OctoMap", 20.777, 99.863, 0.344},
    {"01", "Removert", 94.221, 93.608, 0.939},
    {"01", "ERASOR", 91.487, 95.383, 0.934},
    {"01", "DynamicFilter", 87.950, 87.690, 0.878},
    {"01", "paper, IOC only", 89.498, 84.663, 0.870},
    {"01", "paper, full", 99.262, 87.188, 0.928},
    {"02", "OctoMap", 23.746, 99.792, 0.384},
    {"02", "Removert", 76.319, 96.799, 0.853},
    {"02", "ERASOR", 87.731, 97.008, 0.921},
    {"02", "DynamicFilter", 88.020, 86.100, 0.871},
    {"02", "paper, IOC only", 99.015, 98.672, 0.988},
    {"02", "paper, full", 99.085, 98.716, 0.989},
    {"05", "OctoMap", 33.904, 99.882, 0.506},
    {"05", "Removert", 86.900, 87.880, 0.874},
    {"05", "ERASOR", 88.730, 98.262, 0.933},
    {"05", "DynamicFilter", 90.170, 84.650, 0.873},
    {"05", "paper, IOC only", 97.909, 96.373, 0.971},
    {"05", "paper, full", 98.021, 96.015, 0.970},
    {"07", "OctoMap", 38.183, 99.565, 0.552},
    {"07", "Removert", 80.689, 98.822, 0.888},
    {"07", "ERASOR", 90.624, 99.271, 0.948},
    {"07", "DynamicFilter", 87.940, 86.800, 0.874},
    {"07", "paper, IOC only", 92.084, 95.187, 0.936},
    {"07", "paper, full", 92.165, 95.187, 0.936},
}};

/// Options of all experiments.
struct ExperimentOptions {
  ExperimentOptions(CLI::App& command, const std::string& what) : sequence(command, what) {
    command.add_option("--csv", csv, "write the table to this file");
    command.add_flag("--force", force, "replace files that exist");
  }

  RecordingFlags sequence;
  std::string csv;
  bool force = false;
};

/// Options of experiments that give scores.
struct ScoreOptions : ExperimentOptions {
  ScoreOptions(CLI::App& command, const std::string& what, const std::string& unlabeled,
               const std::string& prefix)
      : ExperimentOptions(command, what), evaluation(command, unlabeled, prefix) {
    ScanWindow::visit(window, SettingFlags{command});
    command.add_flag("--quiet", quiet, "no progress");
  }

  EvaluationOptions evaluation;
  ScanWindow window;
  bool quiet = false;
};

/// A table on standard output, and the same numbers in a file of CSV.
class ResultTable {
 public:
  /// `names`: columns at the left that are text. Throws IoError.
  ResultTable(std::vector<std::string> columns, std::size_t names, const std::string& csv_columns,
              const ExperimentOptions& options, const InputFiles& inputs)
      : table_(std::move(columns), names),
        csv_(csv_columns + '\n'),
        file_(options.csv, options.force, inputs) {}

  /// `source` is the last column of CSV, unless it is empty.
  void add(std::vector<std::string> row, const std::vector<double>& values,
           const std::string& source = "") {
    for (std::size_t i = 0; i < row.size(); ++i) csv_ += (i > 0 ? "," : "") + csv_field(row[i]);
    for (const double value : values) {
      row.push_back(format_number(value, 4));
      csv_ += ',' + format_number(value, 6, "");
    }
    table_.add(row);
    csv_ += (source.empty() ? "" : ',' + source) + '\n';
  }

  void write() {
    std::cout << table_.to_string();
    file_.write(csv_);
  }

 private:
  evaluation::TextTable table_;
  std::string csv_;
  TextFile file_;
};

// ---- Table I ----

struct Table1Options : ScoreOptions {
  explicit Table1Options(CLI::App& command)
      : ScoreOptions(command,
                     "SemanticKITTI (the published windows of 00, 01, 02, 05, 07), or any one "
                     "labelled sequence",
                     "static", "") {
    command.add_option("--json", json, "write everything to this file");
  }

  std::string json;
};

/// A sequence to measure; `name` finds the published rows.
struct Task {
  std::string name;
  fs::path folder;
  ScanWindow window;
};

/// The published windows of the SemanticKITTI sequences below `root`; if there are none, `root` is
/// the sequence.
std::vector<Task> find_tasks(const fs::path& root, const ScanWindow& window) {
  std::vector<Task> tasks;
  for (const PublishedWindow& published : kPublishedWindows) {
    for (const fs::path& below : {root / "sequences", root / "dataset" / "sequences", root}) {
      if (!fs::exists(below / published.sequence / "velodyne")) continue;
      tasks.push_back({published.sequence, below / published.sequence,
                       ScanWindow{published.start, published.end}});
      break;
    }
  }
  if (!tasks.empty()) return tasks;
  const fs::path clean = fs::absolute(root).lexically_normal();
  const fs::path name = clean.has_filename() ? clean.filename() : clean.parent_path().filename();
  return {{name.string(), root, window}};
}

std::vector<Variant> table1_variants() {
  using Config = DynaInsRemover::Config;
  std::vector<Variant> variants = {{"dynains, paper preset, IOC only", Config::paper()},
                                   {"dynains, paper preset, full", Config::paper()},
                                   {"dynains, default preset", Config()}};
  variants[0].config.use_belief = false;
  return variants;
}

void table1(const Table1Options& options) {
  const evaluation::EvaluationConfig config = options.evaluation.config();
  const std::vector<Task> tasks = find_tasks(options.sequence.folder, options.window);
  const RecordingOptions& files = options.sequence.settings.options;
  if (tasks.size() > 1 && !(files.poses.empty() && files.times.empty())) {
    throw ConfigError("--poses and --times need one sequence, not " + std::to_string(tasks.size()));
  }
  const std::vector<Variant> variants = table1_variants();
  InputFiles inputs;
  std::vector<Recording> recordings;
  for (const Task& task : tasks) {
    recordings.push_back(options.sequence.open(task.folder));
    inputs.add(recordings.back());
  }
  TextFile json_file(options.json, options.force, inputs);
  ResultTable table({"Seq.", "Method", "PR [%]", "RR [%]", "F1 score"}, 2,
                    "sequence,method,pr,rr,f1,source", options, inputs);
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const Task& task = tasks[i];
    LabelledSequence sequence(std::move(recordings[i]), task.window);
    Progress progress(sequence.size(), "scans of " + task.name, options.quiet);
    const evaluation::Evaluation result =
        evaluate_variants(sequence, variants, Answer::kFinal, config,
                          [&](std::size_t done) { progress.update(done); });
    for (const PublishedRow& row : kPublishedRows) {
      if (task.name != row.sequence) continue;
      table.add({task.name, std::string(row.method) + " (published)"}, {row.pr, row.rr, row.f1},
                "published");
    }
    for (const EvaluationRow& row : result.rows) {
      table.add({task.name, row.name}, {row.voxels.kept(), row.voxels.removed(), row.voxels.f1()},
                "measured");
    }
    json.push_back({{"sequence", task.name},
                    {"evaluation", nlohmann::ordered_json::parse(evaluation::to_json(result))}});
  }
  table.write();
  json_file.write(to_text(json));
}

// ---- Fig. 5 ----

struct SweepOptions : ScoreOptions {
  explicit SweepOptions(CLI::App& command)
      : ScoreOptions(command, "labelled sequence", "ignore", "eval-"), remover(command, "paper") {
    command.add_option("--parameter", parameter, "any parameter, see dynains config")
        ->capture_default_str();
    command.add_option("--values", values, "values, separated by commas")
        ->delimiter(',')
        ->capture_default_str();
    command.add_flag("--online", online, "judge the zero-latency verdict");
  }

  std::string parameter = "tau-s";
  std::vector<std::string> values = {"0.1", "0.2", "0.3", "0.4", "0.5", "0.6", "0.7", "0.8", "0.9"};
  RemoverOptions remover;
  bool online = false;
};

/// As many at once as one evaluation takes, so that a scan is read once for several values.
std::vector<EvaluationRow> measure(const SweepOptions& options,
                                   const std::vector<Variant>& variants,
                                   LabelledSequence& sequence) {
  const evaluation::EvaluationConfig config = options.evaluation.config();
  std::vector<EvaluationRow> rows;
  const std::size_t batches =
      (variants.size() + evaluation::kMaxEstimates - 1) / evaluation::kMaxEstimates;
  Progress progress(batches * sequence.size(), "scans", options.quiet);
  for (std::size_t batch = 0; batch < batches; ++batch) {
    const std::size_t first = batch * evaluation::kMaxEstimates;
    const std::size_t last = std::min(first + evaluation::kMaxEstimates, variants.size());
    const std::vector<Variant> some(variants.begin() + static_cast<std::ptrdiff_t>(first),
                                    variants.begin() + static_cast<std::ptrdiff_t>(last));
    const evaluation::Evaluation result = evaluate_variants(
        sequence, some, options.online ? Answer::kNewest : Answer::kFinal, config,
        [&](std::size_t done) { progress.update(batch * sequence.size() + done); });
    rows.insert(rows.end(), result.rows.end() - static_cast<std::ptrdiff_t>(some.size()),
                result.rows.end());
  }
  return rows;
}

void sweep(const SweepOptions& options) {
  const std::string name = flag_name(options.parameter);
  std::vector<Variant> variants;
  for (const std::string& value : options.values) {
    Variant variant{value, options.remover.config()};
    ParameterValues values;
    values.set(name, value, "--values: " + name);
    values.apply(variant.config);
    variant.config.validate();
    variants.push_back(variant);
  }
  LabelledSequence sequence(options.sequence.open(), options.window);
  ResultTable table({name, "PR %", "RR %", "F1", "SA %", "DA %", "HA %"}, 1,
                    name + ",pr,rr,f1,sa,da,ha", options,
                    InputFiles(sequence.sequence(), options.remover.config_file()));
  for (const EvaluationRow& row : measure(options, variants, sequence)) {
    const evaluation::Score& points = row.points;
    table.add({row.name}, {row.voxels.kept(), row.voxels.removed(), row.voxels.f1(), points.kept(),
                           points.removed(), points.harmonic()});
  }
  table.write();
}

// ---- Fig. 7 ----

struct RuntimeOptions : ExperimentOptions {
  explicit RuntimeOptions(CLI::App& command)
      : ExperimentOptions(command, "recording (no labels needed)"), remover(command, "paper") {
    command.add_option("--repeat", repeat, "how often to go through the sequence")
        ->check(CLI::Range(1, 100000))
        ->capture_default_str();
  }

  RemoverOptions remover;
  std::size_t repeat = 5;
};

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

void runtime(const RuntimeOptions& options) {
  const Recording sequence = options.sequence.open();
  ResultTable table({"component", "mean ms", "median", "p95", "p99", "max"}, 1,
                    "component,mean_ms,median_ms,p95_ms,p99_ms,max_ms", options,
                    InputFiles(sequence, options.remover.config_file()));
  std::vector<double> points, totals;                 // by frame
  std::map<std::string, std::vector<double>> stages;  // ms
  DynaInsRemover::Config config = options.remover.config();
  take_sensors(sequence, config);
  DynaInsRemover remover(config);
  RecordedScan scan;
  // Each repetition starts with an empty map and warm buffers.
  for (std::size_t repetition = 0; repetition < options.repeat; ++repetition) {
    remover.reset();
    for (std::size_t i = 0; i < sequence.size(); ++i) {
      sequence.read_scan(i, scan);
      const auto begin = std::chrono::steady_clock::now();
      const FrameResult frame = push_scan(remover, sequence, i, scan);
      totals.push_back(ms_since(begin));
      StageTimes::visit(frame.times,
                        [&](const char* stage, double ms) { stages[stage].push_back(ms); });
      points.push_back(static_cast<double>(scan.size()));
    }
  }
  const auto add = [&](const std::string& name, const std::vector<double>& times) {
    const Statistics s = statistics(times);
    table.add({name}, {mean(times), s.median, s.p95, s.p99, s.max});
  };
  const StageTimes none;
  StageTimes::visit(none, [&](const char* stage, double) { add(stage, stages[stage]); });
  add("total", totals);
  std::cout << points.size() << " frames (" << options.repeat << " times "
            << points.size() / options.repeat << "), " << format_number(mean(points), 0)
            << " points on average, preset " << options.remover.preset_name() << '\n';
  table.write();
}

}  // namespace

void add_experiment_command(CLI::App& app) {
  CLI::App& command =
      *app.add_subcommand("experiment", "The paper's experiments on any labelled sequence");
  command.require_subcommand(1);
  add_command<Table1Options>(
      command, "table1",
      "Table I: PR, RR and F1 with and without belief update, beside published numbers", "",
      table1);
  add_command<SweepOptions>(
      command, "sweep",
      "Fig. 5: PR, RR and F1 against a parameter (the similarity threshold by default)", "", sweep);
  add_command<RuntimeOptions>(command, "runtime",
                              "Fig. 7: time per component, without file reading", "", runtime);
}

}  // namespace dynains::program
