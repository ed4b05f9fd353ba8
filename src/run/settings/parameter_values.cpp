#include "parameter_values.hpp"

#include <algorithm>
#include <limits>
#include <locale>
#include <sstream>

#include "dynains/parameters.hpp"
#include "io/byte_reader.hpp"

namespace dynains::run {
namespace {

template <class Real>
std::string format_real(Real value) {
  for (int digits = 6;; ++digits) {
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text.precision(digits);
    text << value;
    const bool exact = digits >= std::numeric_limits<Real>::max_digits10;
    if (exact || parse_value<Real>(text.str()) == value) return text.str();
  }
}

}  // namespace

std::string flag_name(std::string parameter_name) {
  std::replace(parameter_name.begin(), parameter_name.end(), '_', '-');
  return parameter_name;
}

std::string format_value(double value) { return format_real(value); }
std::string format_value(float value) { return format_real(value); }

ParameterValues read_config_file(const std::filesystem::path& path) {
  std::istringstream file(read_text_file(path));
  ParameterValues values;
  std::map<std::string, std::size_t> seen;
  std::size_t number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (line.find('\0') != std::string::npos) {
      throw ConfigError(path.string() + ":" + std::to_string(number) +
                        ": expected a line of text, found a NUL byte");
    }
    line = std::string(text::trimmed(line.substr(0, line.find('#'))));
    if (line.empty()) continue;
    const std::string where = path.string() + ":" + std::to_string(number) + ": ";
    const std::size_t equals = line.find('=');
    const std::string name = flag_name(std::string(text::trimmed(line.substr(0, equals))));
    const std::string value(equals == std::string::npos
                                ? ""
                                : text::trimmed(std::string_view(line).substr(equals + 1)));
    if (name.empty() || value.empty()) {
      throw ConfigError(where + "expected a line such as tau-s = 0.6");
    }
    const auto [first, is_new] = seen.emplace(name, number);
    if (!is_new) {
      throw ConfigError(where + name + " stands on line " + std::to_string(first->second) +
                        " already");
    }
    values.set(name, value, where + name);
  }
  return values;
}

}  // namespace dynains::run
