// Parameters as text, and as lines of a config file: all from Config::visit.
#pragma once

#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <system_error>
#include <type_traits>

#include "dynains/errors.hpp"
#include "dynains/parameters.hpp"
#include "io/text.hpp"

namespace dynains::run {

/// "tau_s" -> "tau-s", the name of the flag and of the line in a config file.
std::string flag_name(std::string parameter_name);

/// Value of a parameter as text; nothing if it is none of that type.
template <class T>
std::optional<T> parse_value(const std::string& text) {
  if constexpr (std::is_enum_v<T>) {
    return value_of_name<T>(text);
  } else if constexpr (std::is_same_v<T, bool>) {
    if (text == "true" || text == "on" || text == "1") return true;
    if (text == "false" || text == "off" || text == "0") return false;
    return std::nullopt;
  } else if constexpr (std::is_integral_v<T>) {
    T value = 0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    if (text.empty() || error != std::errc{} || stop != end) return std::nullopt;
    return value;
  } else {
    const std::optional<double> value = text::parse_number(text);
    if (!value || !std::isfinite(*value)) return std::nullopt;
    return static_cast<T>(*value);
  }
}

/// The number that a text is, for a field that may be empty; without a sign, that of a scan. Throws
/// ConfigError.
template <class T>
std::optional<T> read_number(const std::string& text) {
  const std::optional<T> value = parse_value<T>(text);
  if (value) return value;
  const std::string what = std::is_unsigned_v<T> ? "the number of a scan" : "a number";
  throw ConfigError("expected " + what + ", found " + text);
}

/// The shortest text that reads back to the same value.
std::string format_value(double value);
std::string format_value(float value);
inline std::string format_value(bool value) { return value ? "true" : "false"; }
template <class Integer, std::enable_if_t<std::is_integral_v<Integer>, bool> = true>
std::string format_value(Integer value) {
  return std::to_string(value);
}
template <class Enum, std::enable_if_t<std::is_enum_v<Enum>, bool> = true>
std::string format_value(Enum value) {
  return plain_value(value);
}

/// Kind of value that a parameter takes, for help texts: "true|false", "INT in [2, 64]" ...
template <class T>
std::string describe_range(const Parameter<T>& parameter) {
  using Value = std::remove_const_t<T>;
  if constexpr (std::is_same_v<Value, bool>) {
    return "true|false";
  } else if constexpr (std::is_enum_v<Value>) {
    return all_value_names<Value>();
  } else {
    std::string text = std::is_integral_v<Value> ? "INT" : "FLOAT";
    const Bounds& bounds = parameter.bounds;
    if (std::isfinite(bounds.min) || std::isfinite(bounds.max)) text += " in " + bounds.to_string();
    return *parameter.unit == '\0' ? text : text + ' ' + parameter.unit;
  }
}

template <class T, class Read>
std::string describe_range(const TextParameter<T, Read>& parameter) {
  return parameter.values;
}

/// Assigns `text` to a parameter. `where` starts the message of the ConfigError that is thrown if
/// the text is no such value or the value is out of bounds.
template <class T>
void assign_parameter(const Parameter<T>& parameter, const std::string& text,
                      const std::string& where) {
  const std::optional<T> value = parse_value<T>(text);
  bool valid = value.has_value();
  if constexpr (kIsBounded<T>) {
    valid = valid && parameter.bounds.contain(static_cast<double>(*value));
  }
  if (!valid) {
    throw ConfigError(where + " = " + text + ": expected " + describe_range(parameter) + " (" +
                      parameter.help + ")");
  }
  parameter.value = *value;
}

template <class T, class Read>
void assign_parameter(const TextParameter<T, Read>& parameter, const std::string& text,
                      const std::string& where) {
  try {
    parameter.value = parameter.read(text);
  } catch (const ConfigError& error) {
    throw ConfigError(where + ": " + error.what());
  }
}

/// Values by flag name, each with the place it comes from.
class ParameterValues {
 public:
  void set(const std::string& name, const std::string& text, const std::string& where) {
    values_[name] = {text, where};
  }

  /// Whether a value has this flag name.
  bool has(const std::string& name) const { return values_.count(name) > 0; }

  /// Whether `name` has the value `text`, which is removed.
  bool take(const std::string& name, const std::string& text) {
    const auto found = values_.find(name);
    if (found == values_.end() || found->second.text != text) return false;
    values_.erase(found);
    return true;
  }

  /// Assigns all values to the parameters of `config`. Throws ConfigError, also for unknown names.
  template <class Config>
  void apply(Config& config) const {
    std::map<std::string, Value> left = values_;
    Config::visit(config, [&](const auto& parameter) {
      const auto found = left.find(flag_name(parameter.name));
      if (found == left.end()) return;
      assign_parameter(parameter, found->second.text, found->second.where);
      left.erase(found);
    });
    if (left.empty()) return;
    throw ConfigError(left.begin()->second.where + ": unknown parameter, see dynains config");
  }

 private:
  struct Value {
    std::string text;
    std::string where;
  };
  std::map<std::string, Value> values_;
};

/// Reads lines `name = value`; `#` starts a comment. Throws IoError if the file cannot be read,
/// ConfigError for a line of another form or a name that stands twice.
ParameterValues read_config_file(const std::filesystem::path& path);

}  // namespace dynains::run
