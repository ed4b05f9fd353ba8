// Subcommands: each has one function that adds it to the program; and the flags that they share.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "dynains/io/recording.hpp"
#include "run/estimate_poses.hpp"
#include "run/output/output_folder.hpp"
#include "run/settings/recording_settings.hpp"

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

/// The argument SEQ and the flags that describe its files.
struct RecordingFlags {
  /// `what` starts the help of the argument, for example "labelled sequence". This is not moved
  /// afterwards: flags refer to it.
  RecordingFlags(CLI::App& command, const std::string& what, bool required = true);
  RecordingFlags(const RecordingFlags&) = delete;
  RecordingFlags& operator=(const RecordingFlags&) = delete;

  /// Throws IoError, ConfigError. Warns of scans that are left out because they have no pose, and
  /// of a log that ends early.
  Recording open() const { return open_with(settings.checked()); }
  /// Opens the recording of a finished run with the flags of the run, as far as the command line
  /// names no others. `command`: the command line without SEQ, for messages. Throws IoError.
  Recording open_of_run(const ResultFolder& out, const std::string& command);
  /// Opens the recording without poses, for the odometry. `is_compensated`: see RecordingOptions.
  /// Throws ConfigError if a flag is about poses.
  Recording open_without_poses(bool is_compensated) const;

  std::string folder;
  RecordingSettings settings;  ///< with the flags on the command line

 private:
  Recording open_with(const RecordingOptions& options) const;
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
