// Parameters and settings by name, from the one list of fields of each: keyword arguments have the
// names of the flags of the program, with underscores. A value may be the text of the flag. Also
// the recording that keyword arguments open.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <string>

#include "dynains/errors.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/parameters.hpp"
#include "run/settings/parameter_values.hpp"
#include "run/settings/recording_settings.hpp"

namespace dynains::python {

namespace py = pybind11;

// The parts of the module, one file each.
void bind_config(pybind11::module_& module);
void bind_remover(pybind11::module_& module);
void bind_evaluation(pybind11::module_& module);
void bind_recording(pybind11::module_& module);
void bind_check(pybind11::module_& module);
void bind_run(pybind11::module_& module);

/// The text of a flag with this value; that of a (4, 4) array is `x y z qx qy qz qw`. Throws
/// PoseError for another array that is no list of numbers.
std::string to_text(const py::handle& value);

/// Sets what `name` stands for; None leaves the default. False if no setting has that name. Throws
/// ConfigError for a value that is none of the setting, IoError for a file that cannot be read.
template <class Settings>
bool assign_setting(Settings& settings, const std::string& name, const py::handle& value) {
  bool is_known = false;
  Settings::visit(settings, [&](const auto& setting) {
    if (name != setting.name) return;
    is_known = true;
    if (!value.is_none()) run::assign_parameter(setting, to_text(value), name);
  });
  return is_known;
}

/// Sets the parameters that `values` names. Throws ConfigError, also for unknown names.
template <class Config>
void assign_all(Config& config, const py::dict& values) {
  for (const auto& [key, value] : values) {
    const std::string name = py::str(key);
    if (!assign_setting(config, name, value)) throw ConfigError("unknown parameter " + name);
  }
}

/// Name, meaning and values of each setting, one a line, for docstrings.
template <class Settings>
std::string describe_settings() {
  std::string text;
  const Settings defaults;
  Settings::visit(defaults, [&](const auto& setting) {
    text += std::string("  ") + setting.name + ": " + setting.help + "; " +
            run::describe_range(setting) + '\n';
  });
  return text;
}

template <class Config>
py::dict to_dict(const Config& config) {
  py::dict result;
  Config::visit(config, [&](const auto& parameter) {
    result[parameter.name] = plain_value(parameter.value);
  });
  return result;
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
        [name](Config& self, const py::object& value) { assign_setting(self, name, value); },
        (std::string(parameter.help) + "; " + run::describe_range(parameter)).c_str());
  });
}

/// Settings with the keyword arguments `values`. Throws ConfigError, also for an unknown name,
/// IoError for a file of an extrinsic calibration.
run::RecordingSettings to_recording_settings(const py::dict& values);

struct SharedRecording {
  const Recording recording;  ///< several threads may read
  const py::dict options;     ///< keyword arguments that it was opened with
  const run::RecordingSettings settings;

  /// Calls `work` with the recording, without the interpreter's lock.
  template <class Work>
  auto read(Work&& work) const {
    const py::gil_scoped_release release;
    return work(recording);
  }
};

/// Opens a recording with keyword arguments, or takes an open one, to which none may be given.
std::shared_ptr<SharedRecording> to_recording(const py::object& recording, const py::dict& options);

/// A RuntimeWarning; throws if the caller has made an error of it.
void warn(const std::string& text);
/// Recording::warnings() as such.
void show_warnings(const Recording& recording);

}  // namespace dynains::python
