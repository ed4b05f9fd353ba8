// Parameters of any configuration by name, from its one list of fields.
#pragma once

#include <pybind11/pybind11.h>

#include <sstream>
#include <string>
#include <type_traits>
#include <utility>

#include "dynains/errors.hpp"
#include "dynains/parameters.hpp"

namespace dynains::python {

namespace py = pybind11;

template <class T>
py::object value_of(const Parameter<T>& parameter) {
  return py::cast(parameter.value);
}

/// Throws ConfigError if `value` is out of bounds, TypeError if it is of another type.
template <class T>
void assign(const Parameter<T>& parameter, const py::handle& value) {
  T wanted{};
  try {
    // Nearly everything in Python is true or false, None too.
    if (std::is_same_v<T, bool> && !value.equal(py::bool_(true)) &&
        !value.equal(py::bool_(false))) {
      throw py::cast_error();
    }
    wanted = value.cast<T>();
  } catch (const py::cast_error&) {
    const char* type = std::is_same_v<T, bool> ? "bool" : std::is_integral_v<T> ? "int" : "float";
    throw py::type_error(std::string(parameter.name) + " = " + py::repr(value).cast<std::string>() +
                         ": expected " + type);
  }
  if constexpr (!std::is_same_v<T, bool>) {
    if (!parameter.bounds.contain(static_cast<double>(wanted))) {
      throw ConfigError(std::string(parameter.name) + " = " + py::repr(value).cast<std::string>() +
                        " must be in " + parameter.bounds.to_string() + ' ' + parameter.unit +
                        ": " + parameter.help);
    }
  }
  parameter.value = wanted;
}

/// Sets the parameters that `values` names. Throws ConfigError for a name that there is not.
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

/// Docstring of a parameter: description, interval and unit.
template <class T>
std::string describe(const Parameter<T>& parameter) {
  std::ostringstream text;
  text << parameter.help;
  if constexpr (!std::is_same_v<std::remove_const_t<T>, bool>) {
    text << "; in " << parameter.bounds.to_string();
    if (*parameter.unit != '\0') text << ' ' << parameter.unit;
  }
  return text.str();
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
