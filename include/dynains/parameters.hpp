// Reflection of configuration fields. Each config struct lists its fields once, in `visit()`.
// `validate()`, config files, command-line flags, reports and docs/parameters.md use that list.
//
//   template <class Self, class Visitor>
//   static void visit(Self& self, Visitor&& visitor) {
//     visitor(Parameter{"tau_s", self.tau_s, closed(0.0, 1.0), "", "similarity threshold (Eq.
//     12)"});
//   }
//
// `Self` is the struct or the const struct, so that one list serves readers and writers.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <type_traits>

#include "dynains/errors.hpp"

namespace dynains {

/// Interval of valid values of a parameter. Each end is closed or open.
struct Bounds {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool min_open = false;
  bool max_open = false;

  /// Whether `value` is in the interval; false for NaN.
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

/// The bounds [min, max], (min, max) and (min, max], in the unit of the parameter.
constexpr Bounds closed(double min, double max) { return {min, max, false, false}; }
constexpr Bounds open(double min, double max) { return {min, max, true, true}; }
constexpr Bounds half_open_below(double min, double max) { return {min, max, true, false}; }

/// One field of a configuration: a number, a boolean, or an enum. An enum has the values 0, 1, ...,
/// and the array `value_names(T)` holds their names in this order.
template <class T>
struct Parameter {
  static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>,
                "parameters are numbers, booleans or enums");

  const char* name;  ///< snake_case, unique over all stages
  T& value;          ///< reference into the visited struct
  Bounds bounds;     ///< for numbers; ignored for booleans and enums
  const char* unit;  ///< "m", "deg", "s", "scans" or "" if dimensionless
  const char* help;  ///< one sentence with its source (equation or paper)
};

template <class T>
Parameter(const char*, T&, Bounds, const char*, const char*) -> Parameter<T>;

/// A field of another type, which is written as text.
template <class T, class Read>
struct TextParameter {
  const char* name;    ///< as of Parameter
  T& value;            ///< reference into the visited struct
  Read read;           ///< text -> value; throws ConfigError or IoError
  const char* values;  ///< for help and messages: "m|cm|mm", "FILE" ...
  const char* help;    ///< one sentence, with [default]
};

template <class T, class Read>
TextParameter(const char*, T&, Read, const char*, const char*) -> TextParameter<T, Read>;

/// Whether parameters of type T have bounds.
template <class T>
inline constexpr bool kIsBounded =
    std::is_arithmetic_v<T> && !std::is_same_v<std::remove_const_t<T>, bool>;

/// Value for files and messages: the number, the boolean, or the name of the enum value.
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

/// Names of all values of an enum, for example "window|free_space".
template <class Enum>
std::string all_value_names() {
  std::string result;
  for (const char* name : value_names(Enum())) {
    if (!result.empty()) result += '|';
    result += name;
  }
  return result;
}

/// Enum value with that name; empty if there is none.
template <class Enum>
std::optional<Enum> value_of_name(const std::string& name) {
  const auto& names = value_names(Enum());
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (name == names[i]) return static_cast<Enum>(i);
  }
  return std::nullopt;
}

namespace detail {

/// Throws a ConfigError about the value of a parameter.
[[noreturn]] inline void refuse_value(const std::string& name, const std::string& value,
                                      const std::string& expected, const char* help) {
  throw ConfigError(name + " = " + value + " must be " + expected + " (" + help + ')');
}

/// Throws ConfigError unless `value` is within `bounds`.
inline void require_in(const Bounds& bounds, double value, const char* owner, const char* name,
                       const char* unit, const char* help) {
  if (bounds.contain(value)) return;
  std::ostringstream number, expected;
  number.precision(10);  // integers of 32 bits have no exponent
  number << value;
  expected << "in " << bounds.to_string() << (*unit == '\0' ? "" : " ") << unit;
  refuse_value(std::string(owner) + '.' + name, number.str(), expected.str(), help);
}

}  // namespace detail

/// Throws ConfigError unless every field of `config` is within its bounds. The message starts with
/// `owner`, for example "BeliefUpdater".
template <class Config>
void validate_parameters(const char* owner, const Config& config) {
  Config::visit(config, [owner](const auto& p) {
    using Value = std::remove_const_t<std::remove_reference_t<decltype(p.value)>>;
    if constexpr (std::is_enum_v<Value>) {
      const auto number = static_cast<std::size_t>(p.value);
      if (number < value_names(p.value).size()) return;
      detail::refuse_value(std::string(owner) + '.' + p.name, std::to_string(number),
                           all_value_names<Value>(), p.help);
    } else if constexpr (kIsBounded<Value>) {
      detail::require_in(p.bounds, static_cast<double>(p.value), owner, p.name, p.unit, p.help);
    }
  });
}

}  // namespace dynains
