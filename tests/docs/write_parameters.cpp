// Writes docs/parameters.md to standard output.
#include <algorithm>
#include <array>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <type_traits>

#include "dynains/compiled_remover.hpp"
#include "run/run_settings.hpp"

namespace {

using namespace dynains;
using namespace dynains::run;

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

// By parameter: its default, and other values with the presets that have them.
std::map<std::string, std::string> describe_values() {
  std::map<std::string, std::string> values;
  std::map<std::string, std::map<std::string, std::string>> others;  // presets by value
  for (const std::string& name : preset_names()) {
    const DynaInsRemover::Config config = DynaInsRemover::Config::preset(name);
    DynaInsRemover::Config::visit(config, [&](const auto& parameter) {
      const std::string value = format_value(parameter.value);
      if (value == values.emplace(parameter.name, value).first->second) return;
      std::string& presets = others[parameter.name][value];
      presets += (presets.empty() ? "" : ", ") + name;
    });
  }
  for (const auto& [parameter, presets_of] : others) {
    for (const auto& [value, presets] : presets_of) {
      values[parameter] += " (" + presets + ": " + value + ')';
    }
  }
  return values;
}

// Cells of a table row with a parameter: default, range, unit and meaning.
template <class Parameter>
std::string table_cells(const Parameter& parameter, const std::string& values) {
  std::string range = describe_range(parameter);
  const std::string unit = parameter.unit, type = " in ";  // FLOAT in, INT in
  if (const auto at = range.find(type); at != std::string::npos) range.erase(0, at + type.size());
  if (!unit.empty()) range.erase(range.size() - unit.size() - 1);
  for (std::size_t at = 0; (at = range.find('|', at)) != std::string::npos;) {
    range.replace(at, 1, ", ");
  }
  return values + " | " + range + " | " + unit + " | " + parameter.help + '\n';
}

// The parameters in the documentation: the ones that users change first, then the rest, folded.
void print_parameters() {
  const std::array<const char*, 10> first = {
      "map_voxel",     "min_range", "max_range",       "sensor_height",  "mounting_pitch",
      "mounting_roll", "max_gap",   "lookahead_scans", "pose_tolerance", "threads"};
  std::map<std::string, std::string> values = describe_values(), rows;
  std::ostringstream folded;
  const std::string header =
      "\n\nname | default (by preset) | range | unit | meaning\n---|---|---|---|---\n";
  const DynaInsRemover::Config config;
  DynaInsRemover::Config::visit_sections(config, [&](const char* name, const auto& section) {
    const std::string member = member_of(config, &section);
    std::ostringstream others;
    using Section = std::remove_const_t<std::remove_reference_t<decltype(section)>>;
    Section::visit(section, [&](const auto& parameter) {
      const std::string cells = table_cells(parameter, values[parameter.name]);
      if (std::find(first.begin(), first.end(), std::string(parameter.name)) == first.end()) {
        others << '`' << parameter.name << "` | " << cells;
      } else {
        rows[parameter.name] = '`' + (member + '.') + parameter.name + "` | " + cells;
      }
    });
    if (others.str().empty()) return;
    folded << "\n<details>\n<summary><code>" << member << "</code>: " << name << "</summary>"
           << header << others.str() << "\n</details>\n";
  });
  std::cout
      << "# Parameters\n\n"
         "Written by `tests/docs/write_parameters`. A name is a flag and a line of a configuration "
         "file with hyphens\n(`--map-voxel 0.1`), in C++ a field of the member shown "
         "(`config.map.map_voxel`), in Python a field of the configuration\n(`config.map_voxel`). "
         "`dynains config > my.cfg` prints a file for `--config my.cfg`.\n\n"
         "## Parameters that users change first"
      << header;
  for (const char* name : first) std::cout << rows.at(name);
  std::cout << "\n## All others, by member of the configuration\n" << folded.str();
}

}  // namespace

int main() {
  print_parameters();
  return std::cout.flush() ? 0 : 1;
}
