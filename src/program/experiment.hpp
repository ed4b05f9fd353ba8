// The paper's experiments, each a subcommand of `dynains experiment`.
#pragma once

#include <CLI/CLI.hpp>

namespace dynains::program {

/// `dynains experiment` with its subcommands.
void add_experiment_command(CLI::App& app);

void add_table1_command(CLI::App& experiment);   ///< Table I
void add_sweep_command(CLI::App& experiment);    ///< Fig. 5
void add_runtime_command(CLI::App& experiment);  ///< Fig. 7

}  // namespace dynains::program
