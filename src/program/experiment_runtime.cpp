#include <chrono>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "dynains/errors.hpp"
#include "dynains/evaluation/text_table.hpp"
#include "dynains/io/recording.hpp"
#include "evaluation_options.hpp"
#include "experiment.hpp"
#include "recording_options.hpp"
#include "remover_options.hpp"
#include "run/run_report.hpp"
#include "run/run_sequence.hpp"

namespace dynains::program {
namespace {

using evaluation::format_number;

struct RuntimeOptions {
  explicit RuntimeOptions(CLI::App& command)
      : sequence(command, "recording (no labels needed)"), remover(command, "paper") {}

  RecordingFlags sequence;
  RemoverOptions remover;
  std::size_t repeat = 5;
  std::string csv;
};

/// Times of one component over all frames, ms.
struct Component {
  std::string name;
  std::vector<double> times;

  double mean() const {
    double sum = 0;
    for (const double time : times) sum += time;
    return sum / static_cast<double>(times.size());
  }
};

/// Frames of all repetitions; each starts with an empty map and warm buffers.
std::vector<Component> measure(const RuntimeOptions& options) {
  const Recording sequence = options.sequence.open();
  std::vector<Component> components;
  const StageTimes none;
  StageTimes::visit(none, [&](const char* name, double) { components.push_back({name, {}}); });
  components.push_back({"total", {}});
  components.push_back({"points", {}});

  DynaInsRemover remover(options.remover.config());
  RecordedScan scan;
  for (std::size_t repetition = 0; repetition < options.repeat; ++repetition) {
    remover.reset();
    for (std::size_t i = 0; i < sequence.size(); ++i) {
      sequence.read_scan(i, scan);
      const auto begin = std::chrono::steady_clock::now();
      const FrameResult frame = push_scan(remover, sequence, i, scan);
      const std::chrono::duration<double, std::milli> total =
          std::chrono::steady_clock::now() - begin;
      std::size_t next = 0;
      StageTimes::visit(frame.times,
                        [&](const char*, double ms) { components[next++].times.push_back(ms); });
      components[next++].times.push_back(total.count());
      components[next].times.push_back(static_cast<double>(scan.size()));
    }
  }
  return components;
}

void runtime(const RuntimeOptions& options) {
  TextFile csv_file(options.csv);
  const std::vector<Component> components = measure(options);
  evaluation::TextTable table({"component", "mean ms", "median", "p95", "p99", "max"});
  std::ostringstream csv;
  csv << "component,mean_ms,median_ms,p95_ms,p99_ms,max_ms\n";
  for (std::size_t c = 0; c + 1 < components.size(); ++c) {
    const Component& one = components[c];
    const Statistics times = statistics(one.times);
    std::vector<std::string> row = {one.name};
    csv << one.name;
    for (const double value : {one.mean(), times.median, times.p95, times.p99, times.max}) {
      row.push_back(format_number(value, 3));
      csv << ',' << format_number(value, 6);
    }
    csv << '\n';
    table.add(row);
  }
  const Component& points = components.back();
  std::cout << points.times.size() << " frames (" << options.repeat << " times "
            << points.times.size() / options.repeat << "), " << format_number(points.mean(), 0)
            << " points on average, preset " << options.remover.preset_name() << '\n'
            << table.to_string();
  csv_file.write(csv.str());
}

}  // namespace

void add_runtime_command(CLI::App& experiment) {
  CLI::App& command =
      *experiment.add_subcommand("runtime", "Fig. 7: time per component, without file reading");
  const auto options = std::make_shared<RuntimeOptions>(command);
  command.add_option("--repeat", options->repeat, "how often to go through the sequence")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command.add_option("--csv", options->csv, "write the table to this file");
  command.callback([options] { runtime(*options); });
}

}  // namespace dynains::program
