#include "command.hpp"
#include "dynains/errors.hpp"
#include "program.hpp"

using namespace dynains::program;

int main(int argc, char** argv) {
  Program app("Removes moving objects from LiDAR scans and maps, scan by scan.", "dynains");
  app.require_subcommand(0, 1);
  add_run_command(app);
  add_remap_command(app);
  add_clean_command(app);
  add_map_command(app);
  add_fleet_command(app);
  add_check_command(app);
  add_odometry_command(app);
  add_config_command(app);
  add_eval_command(app);
  add_view_command(app);
  add_grid_command(app);
  app.callback([&app] {
    if (app.get_subcommands().empty()) {
      throw dynains::UsageError("expected a command, for example run (see dynains --help)");
    }
  });
  return app.run(argc, argv);
}
