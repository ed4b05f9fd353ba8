// All parameters of the remover by their names, from their one definition. Without types of ROS.
#pragma once

#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "dynains/errors.hpp"
#include "dynains/parameters.hpp"

namespace dynains_ros {

using RemoverConfig = dynains::DynaInsRemover::Config;

/// The declaration of a parameter without its value. `min` and `max` are its least and its greatest
/// valid value.
struct ParameterText {
  std::string name;
  std::string description;
  bool is_bounded = false;  ///< a number
  double min = 0.0;
  double max = 0.0;
};

namespace detail {

/// The double that is written like `value`: 0.1 for 0.1F.
inline double decimal_value(double value) { return value; }
inline double decimal_value(float value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  double result = value;
  std::from_chars(text, end, result);
  return result;
}

template <class T>
ParameterText text_of(const dynains::Parameter<T>& parameter) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  using Value = std::remove_const_t<T>;
  ParameterText text{parameter.name, parameter.help, false, 0.0, 0.0};
  if (*parameter.unit != '\0') text.description += " [" + std::string(parameter.unit) + ']';
  if constexpr (std::is_enum_v<Value>) {
    text.description += " (" + dynains::all_value_names<Value>() + ')';
  } else if constexpr (dynains::kIsBounded<T>) {
    // Ranges of ROS are closed. The nearest valid number of the type of the parameter ends them.
    const auto next = [](double value, double to) {
      if constexpr (std::is_integral_v<Value>) return value + (to > value ? 1.0 : -1.0);
      return static_cast<double>(std::nextafter(static_cast<Value>(value), static_cast<Value>(to)));
    };
    const dynains::Bounds& bounds = parameter.bounds;
    text.is_bounded = true;
    text.min = bounds.min_open ? next(bounds.min, kInfinity) : bounds.min;
    text.max = bounds.max_open ? next(bounds.max, -kInfinity) : bounds.max;
  }
  return text;
}

template <class T>
[[noreturn]] void refuse(const dynains::Parameter<T>& parameter, const std::string& value,
                         const std::string& expected) {
  throw dynains::ConfigError(std::string(parameter.name) + " = " + value + ": expected " +
                             expected + " (" + parameter.help + ')');
}

template <class Value, class T, class Declare>
void set_number(const dynains::Parameter<T>& parameter, Value preset, Declare&& declare) {
  const Value value = declare(text_of(parameter), preset);
  if (!parameter.bounds.contain(static_cast<double>(value))) {
    refuse(parameter, std::to_string(value), parameter.bounds.to_string());
  }
  parameter.value = static_cast<T>(value);
}

}  // namespace detail

/// Sets each parameter of `config` to `declare(ParameterText, value)`, which gets its present value
/// as a bool, std::int64_t, double or std::string and returns the wanted one. Throws
/// dynains::ConfigError.
template <class Declare>
void set_parameters(RemoverConfig& config, Declare&& declare) {
  RemoverConfig::visit(config, [&declare](const auto& parameter) {
    using Value = std::remove_reference_t<decltype(parameter.value)>;
    if constexpr (std::is_same_v<Value, bool>) {
      parameter.value = declare(detail::text_of(parameter), parameter.value);
    } else if constexpr (std::is_enum_v<Value>) {
      const std::string name =
          declare(detail::text_of(parameter), dynains::plain_value(parameter.value));
      const auto value = dynains::value_of_name<Value>(name);
      if (!value) detail::refuse(parameter, name, dynains::all_value_names<Value>());
      parameter.value = *value;
    } else if constexpr (std::is_integral_v<Value>) {
      detail::set_number(parameter, static_cast<std::int64_t>(parameter.value), declare);
    } else {
      detail::set_number(parameter, detail::decimal_value(parameter.value), declare);
    }
  });
}

/// The topic `name` of the results for a topic of clouds: NAME, NAME_2, NAME_3 and so on.
inline std::string numbered(const std::string& name, std::size_t topic) {
  return topic == 0 ? name : name + '_' + std::to_string(topic + 1);
}

/// The names between the commas of a list.
inline std::vector<std::string> names_in(const std::string& list) {
  std::vector<std::string> names;
  std::istringstream text(list);
  for (std::string name; std::getline(text, name, ',');) names.push_back(name);
  return names;
}

}  // namespace dynains_ros
