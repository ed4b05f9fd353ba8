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

#include <cmath>
#include <cstdint>
#include <limits>
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
constexpr Bounds half_open_above(double min, double max) { return {min, max, false, true}; }

/// One named field of a configuration. Booleans and numbers only.
template <class T>
struct Parameter {
  static_assert(std::is_arithmetic_v<T>, "parameters are numbers or booleans");

  const char* name;  ///< snake_case, unique over all stages
  T& value;          ///< reference into the visited struct, const if the struct is
  Bounds bounds;     ///< ignored for booleans
  const char* unit;  ///< "m", "deg", "s", "scans" or "" if dimensionless
  const char* help;  ///< one sentence with its source (equation or paper)
};

template <class T>
Parameter(const char*, T&, Bounds, const char*, const char*) -> Parameter<T>;

/// Throws ConfigError unless every field of `config` lies within its bounds.
/// `owner` is the name that the message starts with, for example "BeliefUpdater".
template <class Config>
void validate_parameters(const char* owner, const Config& config) {
  Config::visit(config, [owner](const auto& parameter) {
    using Value = std::remove_const_t<std::remove_reference_t<decltype(parameter.value)>>;
    if constexpr (!std::is_same_v<Value, bool>) {
      if (!parameter.bounds.contain(static_cast<double>(parameter.value))) {
        std::ostringstream text;
        text << owner << '.' << parameter.name << " = " << +parameter.value << " must be in "
             << parameter.bounds.to_string();
        if (*parameter.unit != '\0') text << ' ' << parameter.unit;
        text << ": " << parameter.help;
        throw ConfigError(text.str());
      }
    }
  });
}

}  // namespace dynains
