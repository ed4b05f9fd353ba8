// Writes the type stubs of the Python module to standard output: the template, with a line for each
// parameter in place of a line @NAME@, and a method in place of a line "@property NAME: TYPE".
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <string>
#include <type_traits>

#include "dynains/compiled_remover.hpp"
#include "dynains/evaluation/evaluate.hpp"
#include "dynains/parameters.hpp"
#include "run/run_settings.hpp"
#include "run/settings/recording_settings.hpp"

namespace {

template <class T>
std::string type_of(const dynains::Parameter<T>&) {
  using Value = std::remove_const_t<T>;
  if constexpr (std::is_enum_v<Value>) {
    std::string names;
    for (const char* name : value_names(Value())) {
      names += (names.empty() ? "\"" : ", \"") + std::string(name) + '"';
    }
    return "Literal[" + names + ']';
  } else if constexpr (std::is_same_v<Value, bool>) {
    return "bool";
  } else if constexpr (std::is_integral_v<Value>) {
    return "int";
  } else {
    return "float";
  }
}

template <class T, class Read>
std::string type_of(const dynains::TextParameter<T, Read>& parameter) {
  using Value = std::remove_const_t<T>;
  if constexpr (std::is_same_v<Value, std::optional<double>>) return "Optional[float]";
  if constexpr (std::is_same_v<Value, std::optional<int>> ||
                std::is_same_v<Value, std::optional<std::size_t>>) {
    return "Optional[int]";
  }
  if constexpr (std::is_same_v<Value, std::string> ||
                std::is_same_v<Value, std::filesystem::path>) {
    return "Union[str, PathLike[str], None]";
  }
  std::string names = parameter.values;
  if (names.find('|') == std::string::npos) return "Union[ArrayLike, PathLike[str], None]";
  for (std::size_t at = names.find('|'); at != names.npos; at = names.find('|', at + 5)) {
    names.replace(at, 1, "\", \"");
  }
  return "Optional[Literal[\"" + names + "\"]]";
}

/// A line for each parameter: its name, its type, and `end`.
template <class Config>
std::string lines_of(const std::string& indent, const std::string& end) {
  std::string lines;
  const Config defaults;
  Config::visit(defaults, [&](const auto& parameter) {
    lines += indent + parameter.name + ": " + type_of(parameter) + end + '\n';
  });
  return lines;
}

/// The lines that replace a line of the template, which starts with `indent`.
std::string expand(const std::string& indent, const std::string& line) {
  using namespace dynains;
  const std::string as_argument = " = ...,";
  const std::map<std::string, std::string> lists = {
      {"@CONFIG_ATTRIBUTES@", lines_of<DynaInsRemover::Config>(indent, "")},
      {"@CONFIG_ARGUMENTS@", lines_of<DynaInsRemover::Config>(indent, as_argument)},
      {"@EVALUATION_ARGUMENTS@", lines_of<evaluation::EvaluationConfig>(indent, as_argument)},
      {"@RECORDING_ARGUMENTS@", lines_of<run::RecordingSettings>(indent, as_argument)},
      {"@RUN_ARGUMENTS@", lines_of<run::RunSettings>(indent, as_argument)}};
  if (const auto list = lists.find(line); list != lists.end()) return list->second;
  if (line.rfind("@property ", 0) == 0) {  // NAME: TYPE
    const std::size_t name = line.find(' ') + 1, colon = line.find(':');
    return indent + "@property\n" + indent + "def " + line.substr(name, colon - name) +
           "(self) ->" + line.substr(colon + 1) + ": ...\n";
  }
  return indent + line + '\n';
}

}  // namespace

int main(int argc, char** argv) {
  std::ifstream stubs(argc == 2 ? argv[1] : "");
  if (!stubs) {
    std::cerr << "usage: write_stubs TEMPLATE\n";
    return 1;
  }
  for (std::string line; std::getline(stubs, line);) {
    const std::string indent(line, 0, line.find_first_not_of(' '));
    std::cout << (indent.size() == line.size() ? "\n" : expand(indent, line.substr(indent.size())));
  }
  return std::cout.flush() ? 0 : 1;
}
