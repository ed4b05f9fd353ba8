// Keyword arguments that set the fields of a struct, from a table.
#pragma once

#include <pybind11/pybind11.h>

#include <filesystem>
#include <initializer_list>
#include <limits>
#include <string>
#include <utility>

#include "parameters.hpp"

namespace dynains::python {

template <class Target>
struct Setting {
  const char* name;
  const char* values;  ///< for messages, for example "bool"
  const char* help;
  /// Throws py::cast_error if `value` is none of the values.
  void (*set)(Target& target, const py::handle& value);
};

/// Sets what `name` stands for. False if no setting has that name. Throws TypeError for a value of
/// another type or out of bounds.
template <class Target, class Settings>
bool assign_setting(const Settings& settings, Target& target, const std::string& name,
                    const py::handle& value) {
  for (const Setting<Target>& setting : settings) {
    if (name != setting.name) continue;
    try {
      setting.set(target, value);
    } catch (const py::cast_error&) {
      throw py::type_error(name + " = " + py::repr(value).cast<std::string>() + ": expected " +
                           setting.values);
    }
    return true;
  }
  return false;
}

/// Name, meaning and values of each setting, one a line, for docstrings.
template <class Settings>
std::string describe_settings(const Settings& settings) {
  std::string text;
  for (const auto& setting : settings) {
    text += std::string("  ") + setting.name + ": " + setting.help + "; " + setting.values + '\n';
  }
  return text;
}

// Conversions for settings. Numbers and flags may be text, as reports of runs have them.

/// The value that `word` stands for in a list of pairs.
template <class Value>
Value choose(const py::handle& word, std::initializer_list<std::pair<const char*, Value>> values) {
  const auto wanted = word.cast<std::string>();
  for (const auto& [name, value] : values) {
    if (wanted == name) return value;
  }
  throw py::cast_error();
}

/// The value of this name.
template <class Enum>
Enum to_enum(const py::handle& name) {
  const auto value = value_of_name<Enum>(name.cast<std::string>());
  if (!value) throw py::cast_error();
  return *value;
}

inline bool to_flag(const py::handle& value) {
  if (py::isinstance<py::str>(value))
    return choose<bool>(value, {{"true", true}, {"false", false}});
  if (value.equal(py::bool_(true))) return true;
  if (value.equal(py::bool_(false))) return false;
  throw py::cast_error();
}

/// A finite number in [least, most].
double to_number(const py::handle& value, double least = std::numeric_limits<double>::lowest(),
                 double most = std::numeric_limits<double>::max());
/// A whole number in [least, most].
std::int64_t to_whole_number(const py::handle& value, std::int64_t least, std::int64_t most);

/// The path of a str or an os.PathLike.
inline std::filesystem::path to_path(const py::handle& value) {
  if (!py::isinstance<py::str>(value) && !py::hasattr(value, "__fspath__")) throw py::cast_error();
  return py::module_::import("os").attr("fsdecode")(value).cast<std::string>();
}

}  // namespace dynains::python
