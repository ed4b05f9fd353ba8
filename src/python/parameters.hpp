// Parameters of any configuration by name, from its one list of fields.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "dynains/errors.hpp"
#include "dynains/parameters.hpp"
#include "run/parameter_values.hpp"

namespace dynains::python {

namespace py = pybind11;

template <class T>
py::object value_of(const Parameter<T>& parameter) {
  return py::cast(plain_value(parameter.value));
}

/// Names of the values of an enum, None for other parameters.
template <class T>
py::object values_of(const Parameter<T>&) {
  if constexpr (std::is_enum_v<T>) {
    return py::cast(value_names(std::remove_const_t<T>()));
  } else {
    return py::none();
  }
}

/// Type and values that a parameter takes: "int", "str, one of a|b".
template <class T>
std::string type_name() {
  if constexpr (std::is_enum_v<T>) return "str, one of " + all_value_names<T>();
  return std::is_same_v<T, bool> ? "bool" : std::is_integral_v<T> ? "int" : "float";
}

/// Throws py::cast_error if `value` is of another type.
template <class T>
T cast_value(const py::handle& value) {
  if constexpr (std::is_enum_v<T>) {
    const std::optional<T> found = value_of_name<T>(value.cast<std::string>());
    if (!found) throw py::cast_error();
    return *found;
  } else {
    // Nearly everything in Python is true or false, None too.
    if (std::is_same_v<T, bool> && !value.equal(py::bool_(true)) &&
        !value.equal(py::bool_(false))) {
      throw py::cast_error();
    }
    return value.cast<T>();
  }
}

/// Throws ConfigError if `value` is out of bounds, TypeError if it is of another type.
template <class T>
void assign(const Parameter<T>& parameter, const py::handle& value) {
  T wanted{};
  try {
    wanted = cast_value<T>(value);
  } catch (const py::cast_error&) {
    throw py::type_error(std::string(parameter.name) + " = " + py::repr(value).cast<std::string>() +
                         ": expected " + type_name<T>());
  }
  if constexpr (kIsBounded<T>) {
    if (!parameter.bounds.contain(static_cast<double>(wanted))) {
      throw ConfigError(std::string(parameter.name) + " = " + py::repr(value).cast<std::string>() +
                        " must be in " + parameter.bounds.to_string() + ' ' + parameter.unit +
                        ": " + parameter.help);
    }
  }
  parameter.value = wanted;
}

/// Sets the parameters that `values` names. Throws ConfigError for unknown names.
template <class Config>
void assign_all(Config& config, const py::dict& values) {
  for (const std::pair<py::handle, py::handle> item : values) {
    const std::string name = py::str(item.first);
    bool found = false;
    Config::visit(config, [&](const auto& parameter) {
      if (parameter.name != name) return;
      assign(parameter, item.second);
      found = true;
    });
    if (!found) throw ConfigError("unknown parameter " + name);
  }
}

template <class Config>
py::dict to_dict(const Config& config) {
  py::dict result;
  Config::visit(config,
                [&](const auto& parameter) { result[parameter.name] = value_of(parameter); });
  return result;
}

/// Docstring of a parameter: meaning and values.
template <class T>
std::string describe(const Parameter<T>& parameter) {
  return std::string(parameter.help) + "; " + program::describe_range(parameter);
}

/// A property with a docstring for each parameter.
template <class Config, class Class>
void add_properties(Class& bound) {
  const Config defaults;
  Config::visit(defaults, [&](const auto& parameter) {
    const std::string name = parameter.name;
    bound.def_property(
        parameter.name,
        [name](const Config& self) -> py::object { return to_dict(self)[name.c_str()]; },
        [name](Config& self, const py::object& value) {
          py::dict one;
          one[name.c_str()] = value;
          assign_all(self, one);
        },
        describe(parameter).c_str());
  });
}

}  // namespace dynains::python
