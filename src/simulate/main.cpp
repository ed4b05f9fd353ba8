#include <array>
#include <filesystem>
#include <iostream>
#include <string>

#include "dynains/errors.hpp"
#include "program/parameter_flags.hpp"
#include "program/program.hpp"
#include "run/interrupt.hpp"
#include "run/output/output_folder.hpp"
#include "simulation/simulator.hpp"
#include "simulation/write_sequence.hpp"

namespace dynains::program {

using namespace run;

namespace {

enum class Format { kKitti, kMcap };
constexpr std::array<const char*, 2> value_names(Format) { return {"kitti", "mcap"}; }

constexpr const char* kLogName = "drive.mcap";

struct SimulateOptions {
  std::string out;
  Format format = Format::kKitti;
  bool force = false;
  bool quiet = false;
  ParameterValues flags;  // that were given
};

simulation::Config make_config(const SimulateOptions& options) {
  simulation::Config config;
  ParameterValues values = options.flags;
  const bool is_random = values.take("scene", "random");
  values.apply(config);
  if (is_random) {
    config = simulation::random_world(config.seed);
    values.apply(config);
  }
  config.validate();
  if (config.rolling_shutter && config.deskewed <= 0 && options.format == Format::kKitti) {
    throw ConfigError(
        "--rolling-shutter needs --format mcap, or --deskewed: a folder as of "
        "KITTI has no times of points");
  }
  if (config.rig != simulation::Rig::kNone && options.format != Format::kKitti) {
    throw ConfigError("--rig needs --format kitti");
  }
  return config;
}

const OutputKind& simulation_output_kind() {
  static const OutputKind kind = {"simulate", "simulation.json"};
  return kind;
}

OutputListing listing_of(const simulation::Simulator& simulator, Format format) {
  const simulation::Config& config = simulator.config();
  OutputListing listing;
  if (format == Format::kMcap) {
    listing.files = {kLogName};
    return listing;
  }
  listing.files = {"poses.txt", "times.txt", "calib.txt"};
  if (config.has_pose_errors()) {
    listing.files.insert("poses_true.txt");
  }
  listing.folders = {{"velodyne", ".bin"}, {"labels", ".label"}};
  if (config.rig != simulation::Rig::kNone) {
    listing.files.insert("sensors.txt");
    listing.folders.insert({"sensor", ".id"});
  }
  for (std::size_t i = 0; i < simulator.size(); ++i) {
    listing.scans.insert(simulation::scan_name(i));
  }
  return listing;
}

/// Everything that is needed to make this sequence again.
nlohmann::ordered_json describe(const SimulateOptions& options, const simulation::Config& config) {
  nlohmann::ordered_json json = begin_marker(simulation_output_kind());
  json["format"] = plain_value(options.format);
  simulation::Config::visit(
      config, [&](const auto& parameter) { json[parameter.name] = plain_value(parameter.value); });
  return json;
}

/// False if a signal came first.
bool write_scans(simulation::Simulator& simulator, const std::filesystem::path& folder,
                 const SimulateOptions& options) {
  Progress progress(simulator.size(), "scans", options.quiet);
  const auto count = [&](std::size_t done, std::size_t) {
    progress.update(done);
    return InterruptGuard::signal() == 0;
  };
  return options.format == Format::kKitti
             ? simulation::write_sequence(simulator, folder, count)
             : simulation::write_log(simulator, folder / kLogName, count);
}

void simulate(const SimulateOptions& options) {
  const simulation::Config config = make_config(options);
  simulation::Simulator simulator(config);
  OutputFolder out(options.out, simulation_output_kind(), listing_of(simulator, options.format),
                   options.force, InputFiles());
  const InterruptGuard interrupt;
  if (!write_scans(simulator, out.path(), options)) throw Interrupted{InterruptGuard::signal()};
  out.finish(describe(options, config));
  const std::filesystem::path folder = options.out;
  const std::filesystem::path sequence =
      options.format == Format::kKitti ? folder : folder / kLogName;
  if (!options.quiet) std::cout << simulator.size() << " scans: " << sequence.string() << std::endl;
}

int run(int argc, char** argv) {
  Program app("Makes a labelled sequence of a synthetic place.", "dynains_simulate");
  SimulateOptions options;
  app.add_option("OUT", options.out, "folder for the sequence; created, must be empty")
      ->required()
      ->type_name("");
  app.add_flag("--force", options.force, "replace an earlier simulation in OUT");
  SettingFlags{app}(Parameter{"format", options.format, Bounds(), "",
                              "a folder as of KITTI, or a log of ROS 2: OUT/drive.mcap"});
  app.add_flag("-q,--quiet", options.quiet, "print errors only");
  add_parameter_flags(app, simulation::Config(), "Parameters", options.flags);
  app.footer(
      "The same flags give the same files. --scene random draws scene, sensor and every parameter "
      "that is not given\nfrom the seed. simulation.json keeps all parameters.");
  app.callback([&options] { simulate(options); });
  return app.run(argc, argv);
}

}  // namespace
}  // namespace dynains::program

int main(int argc, char** argv) { return dynains::program::run(argc, argv); }
