#include <iostream>
#include <memory>
#include <string>

#include "command.hpp"
#include "dynains/dyna_ins_remover.hpp"
#include "parameter_flags.hpp"
#include "preset.hpp"

namespace dynains::program {
namespace {

void print_config(const std::string& preset_name) {
  std::cout
      << "# Parameters of dynains, preset " << preset_name
      << ". Use: dynains run ... --config FILE\n"
         "# Lines that are left out keep the value of the preset; flags win over this file.\n";
  const DynaInsRemover::Config config = preset(preset_name);
  DynaInsRemover::Config::visit_sections(config, [](const char* name, const auto& section) {
    using Section = std::remove_const_t<std::remove_reference_t<decltype(section)>>;
    std::cout << "\n# ---- " << name << " ----\n";
    Section::visit(section, [](const auto& parameter) {
      std::cout << "\n# " << parameter.help << "; " << describe_range(parameter) << '\n'
                << flag_name(parameter.name) << " = " << format_value(parameter.value) << '\n';
    });
  });
  std::cout.flush();
  if (!std::cout) throw IoError("standard output: cannot be written");
}

}  // namespace

void add_config_command(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("config", "Print a config file with every parameter");
  auto name = std::make_shared<std::string>("default");
  command.add_option("--preset", *name, "default, or paper: the paper to the letter [default]")
      ->check(CLI::IsMember(preset_names()))
      ->type_name("NAME");
  command.callback([name] { print_config(*name); });
}

}  // namespace dynains::program
