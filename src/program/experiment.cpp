#include "experiment.hpp"

namespace dynains::program {

void add_experiment_command(CLI::App& app) {
  CLI::App& experiment =
      *app.add_subcommand("experiment", "The paper's experiments on any labelled sequence");
  experiment.require_subcommand(1);
  add_table1_command(experiment);
  add_sweep_command(experiment);
  add_runtime_command(experiment);
}

}  // namespace dynains::program
