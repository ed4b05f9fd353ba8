#include <algorithm>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/evaluation/text_table.hpp"
#include "evaluation_options.hpp"
#include "experiment.hpp"
#include "progress.hpp"
#include "recording_options.hpp"
#include "remover_options.hpp"
#include "run/labelled_sequence.hpp"
#include "variants.hpp"

namespace dynains::program {
namespace {

using evaluation::EvaluationRow;
using evaluation::format_number;

struct SweepOptions {
  explicit SweepOptions(CLI::App& command)
      : sequence(command, "labelled sequence"),
        remover(command, "paper"),
        evaluation(command, "ignore", "eval-") {}

  RecordingFlags sequence;
  std::string parameter = "tau-s";
  std::vector<std::string> values = {"0.1", "0.2", "0.3", "0.4", "0.5", "0.6", "0.7", "0.8", "0.9"};
  RemoverOptions remover;
  EvaluationOptions evaluation;
  ScanWindow window;
  bool online = false;
  bool quiet = false;
  std::string csv;
};

/// As many at once as one evaluation takes, so that a scan is read once for several values.
std::vector<EvaluationRow> measure(const SweepOptions& options,
                                   const std::vector<Variant>& variants) {
  const evaluation::EvaluationConfig config = options.evaluation.config();
  LabelledSequence sequence(options.sequence.open(), options.window);
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
  TextFile csv_file(options.csv);
  const std::vector<EvaluationRow> rows = measure(options, variants);

  evaluation::TextTable table({name, "PR %", "RR %", "F1", "SA %", "DA %", "HA %"});
  std::ostringstream csv;
  csv << name << ",pr,rr,f1,sa,da,ha\n";
  for (const EvaluationRow& row : rows) {
    const double pr = row.voxels.preservation_rate();
    const double rr = row.voxels.rejection_rate();
    const double f1 = row.voxels.f1();
    const evaluation::PointScore& points = row.points;
    table.add({row.name, format_number(pr, 3), format_number(rr, 3), format_number(f1, 4),
               format_number(points.static_accuracy(), 3),
               format_number(points.dynamic_accuracy(), 3),
               format_number(points.harmonic_accuracy(), 3)});
    csv << row.name;
    for (const double value : {pr, rr, f1, points.static_accuracy(), points.dynamic_accuracy(),
                               points.harmonic_accuracy()}) {
      csv << ',' << format_number(value, 6, "");
    }
    csv << '\n';
  }
  std::cout << table.to_string();
  csv_file.write(csv.str());
}

}  // namespace

void add_sweep_command(CLI::App& experiment) {
  CLI::App& command = *experiment.add_subcommand(
      "sweep", "Fig. 5: PR, RR and F1 against a parameter (the similarity threshold by default)");
  const auto options = std::make_shared<SweepOptions>(command);
  command.add_option("--parameter", options->parameter, "any parameter, see dynains config")
      ->capture_default_str();
  command.add_option("--values", options->values, "values, separated by commas")
      ->delimiter(',')
      ->capture_default_str();
  add_window_options(command, options->window);
  command.add_flag("--online", options->online, "judge the zero-latency verdict");
  command.add_flag("--quiet", options->quiet, "no progress");
  command.add_option("--csv", options->csv, "write the table to this file");
  command.callback([options] { sweep(*options); });
}

}  // namespace dynains::program
