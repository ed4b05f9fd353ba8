#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "command.hpp"
#include "dynains/io/folder_lock.hpp"
#include "dynains/simulation/simulator.hpp"
#include "dynains/simulation/write_sequence.hpp"
#include "dynains/version.hpp"
#include "interrupt.hpp"
#include "output_folder.hpp"
#include "parameter_flags.hpp"
#include "progress.hpp"
#include "run_report.hpp"

namespace dynains::program {
namespace {

struct SimulateOptions {
  std::string out;
  std::string scene = "urban";
  std::string sensor = "hdl64";
  std::string labelling = "ever";
  bool force = false;
  bool quiet = false;
  ParameterFlags flags;
};

simulation::Config make_config(const SimulateOptions& options) {
  simulation::Config config;
  config.scene = simulation::scene_from_name(options.scene);
  config.sensor = simulation::sensor_from_name(options.sensor);
  config.labelling = simulation::labelling_from_name(options.labelling);
  options.flags.values().apply(config);
  config.validate();
  return config;
}

OutputFiles files_of_a_simulation() {
  OutputFiles files;
  files.marker = "simulation.json";
  files.files = {"poses.txt", "poses_true.txt", "times.txt", "calib.txt"};
  files.folders = {"velodyne", "labels"};
  files.extensions = {".bin", ".label"};
  return files;
}

/// What makes the same sequence again.
std::string describe(const SimulateOptions& options, const simulation::Config& config) {
  nlohmann::ordered_json json = {{"program", "dynains"},
                                 {"version", kVersionString},
                                 {"scene", options.scene},
                                 {"sensor", options.sensor},
                                 {"labelling", options.labelling}};
  simulation::Config::visit(config,
                            [&](const auto& parameter) { json[parameter.name] = parameter.value; });
  return to_text(json);
}

void simulate(const SimulateOptions& options) {
  const simulation::Config config = make_config(options);
  simulation::Simulator simulator(config);
  create_folder(options.out);
  const FolderLock lock(options.out);
  check_output_folder(options.out, files_of_a_simulation(), options.force);
  clear_output_folder(options.out, files_of_a_simulation(), describe(options, config));
  const InterruptGuard interrupt;
  bool complete = false;
  {
    Progress progress(simulator.size(), "scans", options.quiet);
    complete =
        simulation::write_sequence(simulator, options.out, [&](std::size_t done, std::size_t) {
          progress.update(done);
          return InterruptGuard::signal() == 0;
        });
  }
  if (!complete) throw Interrupted{InterruptGuard::signal()};
  if (!options.quiet) std::cout << simulator.size() << " scans: " << options.out << std::endl;
}

std::string list(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

void add_simulate_command(CLI::App& app) {
  CLI::App& command =
      *app.add_subcommand("simulate", "Make a labelled sequence of a synthetic place");
  auto options = std::make_shared<SimulateOptions>();
  command.add_option("OUT", options->out, "folder for the sequence; created, must be empty")
      ->required()
      ->type_name("");
  command.add_flag("--force", options->force, "replace an earlier simulation in OUT");
  const auto add_choice = [&](const char* flag, std::string& value,
                              const std::vector<std::string>& names) {
    command.add_option(flag, value, list(names) + " [" + value + ']')
        ->check(CLI::IsMember(names))
        ->type_name("NAME");
  };
  add_choice("--scene", options->scene, simulation::scene_names());
  add_choice("--sensor", options->sensor, simulation::sensor_names());
  add_choice("--labelling", options->labelling, simulation::labelling_names());
  command.add_flag("-q,--quiet", options->quiet, "print errors only");
  options->flags.add_to(command, simulation::Config(), "Parameters");
  command.footer(
      "The same flags give the same files. simulation.json keeps them; poses.txt is written last.");
  command.callback([options] { simulate(*options); });
}

}  // namespace dynains::program
