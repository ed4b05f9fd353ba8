// Subcommands: each has one function that adds it to the program.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "run/estimate_poses.hpp"

namespace dynains::program {

using namespace run;  // what commands start

// The callback of a subcommand does the work. It throws ConfigError for wrong flags, UsageError for
// a folder in use, Interrupted after a signal, and other exceptions for failures. main() prints
// them.
void add_run_command(CLI::App& app);
void add_remap_command(CLI::App& app);
void add_clean_command(CLI::App& app);
void add_map_command(CLI::App& app);
void add_fleet_command(CLI::App& app);
void add_check_command(CLI::App& app);
void add_odometry_command(CLI::App& app);
void add_config_command(CLI::App& app);
void add_eval_command(CLI::App& app);
void add_view_command(CLI::App& app);
void add_grid_command(CLI::App& app);

/// Adds a command to `app`. `Options(CLI::App&)` declares its arguments and flags; `work(options)`
/// is its callback.
template <class Options, class Work>
void add_command(CLI::App& app, const char* name, const char* help, const char* footer, Work work) {
  CLI::App& command = *app.add_subcommand(name, help);
  command.footer(footer);
  const auto options = std::make_shared<Options>(command);
  command.callback([options, work] { work(*options); });
}

/// An argument without a flag, which must be given. It is not moved: the command refers to it.
struct Argument {
  Argument(CLI::App& command, const char* name, const char* help) {
    command.add_option(name, value, help)->required()->type_name("");
  }
  Argument(const Argument&) = delete;
  Argument& operator=(const Argument&) = delete;

  std::string value;
};

/// Adds --no-deskew.
void add_compensated_flag(CLI::App& command, bool& is_compensated);

/// As estimate_poses(), with progress on standard error. Warns of directions that nothing
/// determines.
PoseEstimate estimate_with_progress(Recording& recording, const ScanWindow& window, bool one_thread,
                                    bool quiet);

/// Prints where a grid was written, and PlacedGrid::summary().
void print_grid(const std::filesystem::path& file, const nlohmann::ordered_json& summary);

/// An interrupted run exits with 128 + the number of the signal.
enum ExitCode {
  kExitFailure = 1,
  kExitUsage = 2,
  kExitLostTrack = 3  ///< of the odometry; results before it are complete
};

/// The checked recording has a defect, which the command has printed.
struct Finding {};

}  // namespace dynains::program
