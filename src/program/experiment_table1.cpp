#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/evaluation/report.hpp"
#include "dynains/evaluation/text_table.hpp"
#include "evaluation_options.hpp"
#include "experiment.hpp"
#include "progress.hpp"
#include "published_table.hpp"
#include "recording_options.hpp"
#include "run/labelled_sequence.hpp"
#include "variants.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;
using evaluation::csv_field;
using evaluation::format_number;

struct Table1Options {
  explicit Table1Options(CLI::App& command)
      : root(command,
             "SemanticKITTI (the published windows of 00, 01, 02, 05, 07), or any one labelled "
             "sequence"),
        evaluation(command, "static") {}

  RecordingFlags root;
  EvaluationOptions evaluation;
  ScanWindow window;
  bool quiet = false;
  std::string json;
  std::string csv;
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
                                   {"dynains, default preset, one pass", Config()},
                                   {"dynains, default preset", Config(), 2}};
  variants[0].config.use_belief = false;
  return variants;
}

void table1(const Table1Options& options) {
  const evaluation::EvaluationConfig config = options.evaluation.config();
  const std::vector<Task> tasks = find_tasks(options.root.folder(), options.window);
  if (tasks.size() > 1 && options.root.names_files()) {
    throw ConfigError("--poses and --times need one sequence, not " + std::to_string(tasks.size()));
  }
  const std::vector<Variant> variants = table1_variants();
  TextFile json_file(options.json);
  TextFile csv_file(options.csv);

  evaluation::TextTable table({"Seq.", "Method", "PR [%]", "RR [%]", "F1 score"}, 2);
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  std::ostringstream csv;
  csv << "sequence,method,pr,rr,f1,source\n";
  const auto add = [&](const std::string& sequence, const std::string& method, double pr, double rr,
                       double f1, const char* source) {
    table.add({sequence, method, format_number(pr, 3), format_number(rr, 3), format_number(f1, 3)});
    csv << csv_field(sequence) << ',' << csv_field(method) << ',' << format_number(pr, 6, "") << ','
        << format_number(rr, 6, "") << ',' << format_number(f1, 6, "") << ',' << source << '\n';
  };

  for (const Task& task : tasks) {
    LabelledSequence sequence(options.root.open(task.folder), task.window);
    Progress progress(sequence.size(), "scans of " + task.name, options.quiet);
    const evaluation::Evaluation result =
        evaluate_variants(sequence, variants, Answer::kFinal, config,
                          [&](std::size_t done) { progress.update(done); });
    for (const PublishedRow& row : kPublishedRows) {
      if (task.name != row.sequence) continue;
      add(task.name, std::string(row.method) + " (published)", row.pr, row.rr, row.f1, "published");
    }
    for (const evaluation::EvaluationRow& row : result.rows) {
      add(task.name, row.name, row.voxels.preservation_rate(), row.voxels.rejection_rate(),
          row.voxels.f1(), "measured");
    }
    json.push_back({{"sequence", task.name},
                    {"evaluation", nlohmann::ordered_json::parse(evaluation::to_json(result))}});
  }

  std::cout << table.to_string();
  json_file.write(json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) +
                  '\n');
  csv_file.write(csv.str());
}

}  // namespace

void add_table1_command(CLI::App& experiment) {
  CLI::App& command = *experiment.add_subcommand(
      "table1", "Table I: PR, RR and F1 with and without belief update, beside published numbers");
  const auto options = std::make_shared<Table1Options>(command);
  add_window_options(command, options->window);
  command.add_flag("--quiet", options->quiet, "no progress");
  command.add_option("--json", options->json, "write everything to this file");
  command.add_option("--csv", options->csv, "write the table to this file");
  command.callback([options] { table1(*options); });
}

}  // namespace dynains::program
