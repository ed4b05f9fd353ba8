// What a subcommand is: one function that adds it to the program.
#pragma once

#include <CLI/CLI.hpp>

namespace dynains::program {

// Each adds a subcommand whose callback does the work and throws what goes wrong: ConfigError for
// wrong flags, UsageError for a folder that is in use, anything else for failures, Interrupted
// after a signal. main() prints.
void add_run_command(CLI::App& app);
void add_check_command(CLI::App& app);
void add_config_command(CLI::App& app);
void add_simulate_command(CLI::App& app);
void add_statistics_command(CLI::App& app);

/// Exit codes; an interrupted run exits with 128 + the number of the signal.
inline constexpr int kExitFailure = 1;
inline constexpr int kExitUsage = 2;

/// What a command looked for is not in order; it has said so itself.
struct Finding {};

/// A signal ended the work early; what was finished is written.
struct Interrupted {
  int signal;
};

}  // namespace dynains::program
