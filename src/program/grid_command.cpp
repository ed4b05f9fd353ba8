#include <filesystem>
#include <iomanip>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "command.hpp"
#include "dynains/errors.hpp"
#include "parameter_flags.hpp"
#include "program.hpp"
#include "run/interrupt.hpp"
#include "run/output/output_folder.hpp"
#include "run/verdict_files.hpp"
#include "run/write_grid.hpp"
#include "run/write_view.hpp"

namespace dynains::program {
namespace {

namespace fs = std::filesystem;

struct GridOptions {
  explicit GridOptions(CLI::App& command)
      : source(command, "MAP", "static map (.ply, .pcd, .las), or folder of `dynains run`"),
        sequence(command, "recording of the run", false) {
    command.add_option("-o,--out", out, "description of the grid; its image, .pgm, lies beside it")
        ->capture_default_str()
        ->type_name("FILE.yaml");
    grid::Config::visit(config, SettingFlags{command});
    command.add_flag("--keep-moving", keep_moving,
                     "what moved counts as if it were static, to see what removal changes");
    command.add_flag("--force", force, "replace the grid if it exists");
    command.add_flag("-q,--quiet", quiet, "print errors only");
  }

  Argument source;
  RecordingFlags sequence;
  std::string out = "map.yaml";
  grid::Config config;
  bool keep_moving = false;
  bool force = false;
  bool quiet = false;
};

/// Throws Interrupted.
PlacedGrid grid_of_results(GridOptions& options, const ResultFolder& out,
                           const Recording& recording) {
  const std::vector<std::size_t> scans = scans_of_run(out, recording);
  Progress progress(2 * scans.size(), "scans", options.quiet);
  const VerdictFiles files(out.path());
  VerdictArrays verdict;
  const auto read = [&](std::size_t i, const RecordedScan& scan, std::vector<PointLabel>& labels) {
    files.read(recording.name(i), scan.size()).unpack(scan, verdict);
    std::swap(labels, verdict.labels);
  };
  return grid_of_run(read, recording, scans, options.config, options.keep_moving,
                     [&](std::size_t done) { progress.update(done); });
}

void write(GridOptions& options) {
  const fs::path file = grid_file(options.out);
  const std::string& source = options.source.value;
  options.config.validate();
  std::optional<ResultFolder> run;
  std::optional<Recording> recording;
  InputFiles inputs;
  if (fs::is_directory(source)) {
    run.emplace(open_finished_run(source));
    recording.emplace(options.sequence.open_of_run(*run, "dynains grid " + source));
    inputs = InputFiles(*recording);
    inputs.add_results(*run);
  } else if (options.keep_moving) {
    throw ConfigError(
        "--keep-moving needs a folder of `dynains run`: a map has nothing that moves");
  }
  if (!run) inputs.add(source);
  OutputFile image(grid_image(file), existing_by(options.force), inputs);
  OutputFile description(file, existing_by(options.force), inputs);

  const InterruptGuard interrupt;
  const PlacedGrid made =
      recording ? grid_of_results(options, *run, *recording) : grid_of_map(source, options.config);
  for (const std::string& doubt : made.doubts) print_warning(doubt);
  grid::write_grid(image.path(), description.path(), made.grid, made.origin);
  image.put_in_place([&] { description.put_in_place(); });
  if (!options.quiet) print_grid(description.target(), made.summary());
}

}  // namespace

void print_grid(const fs::path& file, const nlohmann::ordered_json& summary) {
  const auto percent = [&](const char* field) { return 100.0 * summary[field].get<double>(); };
  std::cout << std::fixed << std::setprecision(1) << "grid: " << file.string() << " ("
            << summary["width"] << " x " << summary["height"] << " cells: " << percent("free")
            << " % free, " << percent("occupied") << " % occupied)" << std::endl;
}

void add_grid_command(CLI::App& app) {
  add_command<GridOptions>(
      app, "grid", "Write an occupancy grid for nav2 of the static map or the results of a run",
      "Occupied are static points at least --min-height and at most --max-height above the ground "
      "around them. Free is\nwhere the ground was seen or, for results of a run, where beams have "
      "passed low. SEQ and its flags are those of\nthe run unless you give them.",
      write);
}

}  // namespace dynains::program
