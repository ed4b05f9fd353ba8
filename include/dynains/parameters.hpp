// One definition per configuration field. `validate()`, config files, command-line flags, reports
// and the parameter table in docs/ are all visits over the same list.
//
// A config struct lists its fields once:
//
//   template <class Self, class Visitor>
//   static void visit(Self& self, Visitor&& visitor) {
//     visitor(Parameter{"tau_s", self.tau_s, closed(0.0, 1.0), "", "similarity threshold (Eq.
//     12)"});
//   }
//
// `Self` is the struct, const or not, so that one list serves readers and writers.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <type_traits>

#include "dynains/errors.hpp"

namespace dynains {

/// Interval of valid values of a parameter; either end can be open.
struct Bounds {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool min_open = false;
  bool max_open = false;

  /// False for NaN, whatever the interval.
  bool contain(double value) const {
    return (min_open ? value > min : value >= min) && (max_open ? value < max : value <= max);
  }

  /// Interval notation, for example "(0.5, 1]".
  std::string to_string() const {
    std::ostringstream text;
    text << (min_open ? '(' : '[') << min << ", " << max << (max_open ? ')' : ']');
    return text.str();
  }
};

constexpr Bounds closed(double min, double max) { return {min, max, false, false}; }
constexpr Bounds open(double min, double max) { return {min, max, true, true}; }
constexpr Bounds half_open_below(double min, double max) { return {min, max, true, false}; }

/// One named field of a configuration: a number, a boolean, or an enum whose values 0, 1, ... have
/// the names that the array `value_names(T)` holds in the same order.
template <class T>
struct Parameter {
  static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>,
                "parameters are numbers, booleans or enums");

  const char* name;  ///< snake_case, unique over all stages
  T& value;          ///< reference into the visited struct, const if the struct is
  Bounds bounds;     ///< of numbers; ignored for booleans and enums
  const char* unit;  ///< "m", "deg", "s", "scans" or "" if dimensionless
  const char* help;  ///< one sentence with its source (equation or paper)
};

template <class T>
Parameter(const char*, T&, Bounds, const char*, const char*) -> Parameter<T>;

/// Whether the bounds of a parameter of type T mean anything.
template <class T>
inline constexpr bool kIsBounded =
    std::is_arithmetic_v<T> && !std::is_same_v<std::remove_const_t<T>, bool>;

/// The value as a number, a boolean or the name of an enum's value: what files and messages hold.
template <class T>
auto plain_value(T value) {
  if constexpr (std::is_enum_v<T>) {
    const auto index = static_cast<std::size_t>(value);
    const auto& names = value_names(value);
    return std::string(index < names.size() ? names[index] : "unknown");
  } else {
    return value;
  }
}

/// Names of all values of an enum: "window|free_space|both".
template <class Enum>
std::string all_value_names() {
  std::string result;
  for (const char* name : value_names(Enum()))
    result += (result.empty() ? "" : "|") + std::string(name);
  return result;
}

/// The value of that name, if there is one.
template <class Enum>
std::optional<Enum> value_of_name(const std::string& name) {
  const auto& names = value_names(Enum());
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (name == names[i]) return static_cast<Enum>(i);
  }
  return std::nullopt;
}

/// Throws ConfigError unless every field of `config` lies within its bounds.
/// `owner` is the name that the message starts with, for example "BeliefUpdater".
template <class Config>
void validate_parameters(const char* owner, const Config& config) {
  Config::visit(config, [owner](const auto& parameter) {
    using Value = std::remove_const_t<std::remove_reference_t<decltype(parameter.value)>>;
    std::ostringstream text;
    text << owner << '.' << parameter.name << " = ";
    if constexpr (std::is_enum_v<Value>) {
      const auto number = static_cast<std::size_t>(parameter.value);
      if (number < value_names(parameter.value).size()) return;
      text << number << " must be " << all_value_names<Value>();
    } else if constexpr (kIsBounded<Value>) {
      if (parameter.bounds.contain(static_cast<double>(parameter.value))) return;
      text << +parameter.value << " must be in " << parameter.bounds.to_string();
      if (*parameter.unit != '\0') text << ' ' << parameter.unit;
    } else {
      return;
    }
    throw ConfigError(text.str() + ": " + parameter.help);
  });
}

struct RenamedParameter {
  const char* former_name;  ///< snake_case
  const char* present_name;
  const char* note;  ///< how values translate; empty if they stay the same
};

inline constexpr RenamedParameter kRenamedParameters[] = {
    {"use_free_space", "decision", "true: free_space or both, false: window"},
    {"horizon", "lookahead_scans", ""},
    {"memory", "lookback_scans", ""},
    {"ground_reach", "ground_test_distance", ""},
    {"remove_share", "removal_ratio", ""},
    {"see_share", "pass_ratio", ""},
    {"passage_cell", "dynamic_grid_cell", ""},
    {"passage_share", "dynamic_grid_ratio", ""},
    {"see_past_movers", "ignore_dynamic_returns", ""},
};

/// Text for an error message: the present name of `former_name`, or an empty text if no parameter
/// ever had that name.
inline std::string renaming_of(const std::string& former_name) {
  for (const RenamedParameter& renamed : kRenamedParameters) {
    if (former_name != renamed.former_name) continue;
    const std::string note = renamed.note;
    return std::string("is now called ") + renamed.present_name +
           (note.empty() ? "" : " (" + note + ")");
  }
  return {};
}

}  // namespace dynains
