// Settings of recordings and runs as keyword arguments: the names of the flags of the program, with
// underscores. A value may be the text of the flag.
#pragma once

#include <pybind11/pybind11.h>

#include <string>

#include "parameters.hpp"
#include "run/parameter_values.hpp"
#include "run/recording_settings.hpp"

namespace dynains::python {

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
    if (!value.is_none()) program::assign_parameter(setting, to_text(value), name);
  });
  return is_known;
}

template <class Settings>
bool has_setting(const std::string& name) {
  bool is_known = false;
  const Settings defaults;
  Settings::visit(defaults, [&](const auto& setting) { is_known |= name == setting.name; });
  return is_known;
}

/// Name, meaning and values of each setting, one a line, for docstrings.
template <class Settings>
std::string describe_settings() {
  std::string text;
  const Settings defaults;
  Settings::visit(defaults, [&](const auto& setting) {
    text += std::string("  ") + setting.name + ": " + setting.help + "; " +
            program::describe_range(setting) + '\n';
  });
  return text;
}

/// Settings with the keyword arguments `values`. Throws ConfigError, also for an unknown name,
/// IoError for a file of an extrinsic calibration.
program::RecordingSettings to_recording_settings(const py::dict& values);

}  // namespace dynains::python
