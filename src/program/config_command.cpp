#include <iostream>
#include <string>
#include <type_traits>

#include "command.hpp"
#include "dynains/compiled_remover.hpp"
#include "run/run_settings.hpp"

namespace dynains::program {
namespace {

struct ConfigOptions {
  explicit ConfigOptions(CLI::App& command) {
    command
        .add_option(
            "--preset", preset,
            "default; offline: verdicts wait for 100 later scans; paper: the paper to the letter; "
            "published: its public implementation [default]")
        ->check(CLI::IsMember(preset_names()))
        ->type_name("NAME");
  }

  std::string preset = "default";
};

void print_config(const ConfigOptions& options) {
  std::cout
      << "# Parameters of dynains, preset " << options.preset
      << ". Use: dynains run ... --config FILE\n"
         "# Lines that are left out keep the value of the preset; flags win over this file.\n";
  const DynaInsRemover::Config config = DynaInsRemover::Config::preset(options.preset);
  DynaInsRemover::Config::visit_sections(config, [](const char* name, const auto& section) {
    using Section = std::remove_const_t<std::remove_reference_t<decltype(section)>>;
    std::cout << "\n# ---- " << name << " ----\n";
    Section::visit(section, [](const auto& parameter) {
      std::cout << "\n# " << parameter.help << "; " << describe_range(parameter) << '\n'
                << flag_name(parameter.name) << " = " << format_value(parameter.value) << '\n';
    });
  });
}

}  // namespace

void add_config_command(CLI::App& app) {
  add_command<ConfigOptions>(app, "config", "Print a config file with every parameter", "",
                             print_config);
}

}  // namespace dynains::program
