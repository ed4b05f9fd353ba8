#include <iostream>
#include <map>
#include <memory>
#include <string>

#include "command.hpp"
#include "dynains/compiled_remover.hpp"
#include "parameter_flags.hpp"
#include "run/preset.hpp"

namespace dynains::program {
namespace {

void print_config(const std::string& preset_name) {
  std::cout
      << "# Parameters of dynains, preset " << preset_name
      << ". Use: dynains run ... --config FILE\n"
         "# Lines that are left out keep the value of the preset; flags win over this file.\n";
  const DynaInsRemover::Config config = DynaInsRemover::Config::preset(preset_name);
  DynaInsRemover::Config::visit_sections(config, [](const char* name, const auto& section) {
    using Section = std::remove_const_t<std::remove_reference_t<decltype(section)>>;
    std::cout << "\n# ---- " << name << " ----\n";
    Section::visit(section, [](const auto& parameter) {
      std::cout << "\n# " << parameter.help << "; " << describe_range(parameter) << '\n'
                << flag_name(parameter.name) << " = " << format_value(parameter.value) << '\n';
    });
  });
}

// The C++ expression of a section of `config`, found by the address of the section:
// a member that is renamed does not compile, a section that is missing throws.
std::string member_of(const DynaInsRemover::Config& config, const void* section) {
  const std::map<const void*, std::string> members = {
      {static_cast<const RemoverConfig*>(&config), "config"},
      {&config.ground, "config.ground"},
      {&config.clusterer, "config.clusterer"},
      {&config.descriptor, "config.descriptor"},
      {&config.belief, "config.belief"},
      {&config.evidence, "config.evidence"},
      {&config.map, "config.map"},
  };
  return members.at(section);
}

// By parameter: its default, and the values of the presets that differ from it.
std::map<std::string, std::string> describe_values() {
  std::map<std::string, std::string> values;
  std::map<std::string, std::string> defaults;
  for (const std::string& name : preset_names()) {
    const DynaInsRemover::Config config = DynaInsRemover::Config::preset(name);
    DynaInsRemover::Config::visit(config, [&](const auto& parameter) {
      const std::string value = format_value(parameter.value);
      if (defaults.emplace(parameter.name, value).second) {
        values[parameter.name] = value;
      } else if (value != defaults[parameter.name]) {
        values[parameter.name] += " (" + name + ": " + value + ')';
      }
    });
  }
  return values;
}

// The parameters in the documentation.
void print_markdown() {
  std::map<std::string, std::string> values = describe_values();
  const std::string number = "FLOAT in ";
  std::cout
      << "# Parameters\n\n"
         "Written by `dynains config --markdown`: name, default, values of presets that differ, "
         "range, meaning. Flags and config\nfiles have hyphens (`--tau-s 0.5`). In C++, a name is "
         "a field of the member in the heading (`config.belief.tau_p`), in\nPython one of the "
         "configuration (`config.tau_p`).\n";
  const DynaInsRemover::Config config;
  DynaInsRemover::Config::visit_sections(config, [&](const char* name, const auto& section) {
    std::cout << "\n## " << name << ": `" << member_of(config, &section) << "`\n\n";
    using Section = std::remove_const_t<std::remove_reference_t<decltype(section)>>;
    Section::visit(section, [&](const auto& parameter) {
      std::string range = describe_range(parameter);
      if (range.rfind(number, 0) == 0) range.erase(0, number.size());
      std::cout << "- `" << parameter.name << "` " << values[parameter.name] << ", " << range
                << ": " << parameter.help << '\n';
    });
  });
}

}  // namespace

void add_config_command(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("config", "Print a config file with every parameter");
  auto name = std::make_shared<std::string>("default");
  command
      .add_option(
          "--preset", *name,
          "default; offline: verdicts wait for 100 later scans; paper: the paper to the letter; "
          "published: its public implementation [default]")
      ->check(CLI::IsMember(preset_names()))
      ->type_name("NAME");
  auto markdown = std::make_shared<bool>(false);
  command.add_flag("--markdown", *markdown, "Print all presets as a table instead");
  command.callback([name, markdown] {
    if (*markdown) {
      print_markdown();
    } else {
      print_config(*name);
    }
  });
}

}  // namespace dynains::program
