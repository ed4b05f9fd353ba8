// Options of a recording as keyword arguments. The names are those of the flags of the program,
// with underscores.
#pragma once

#include <pybind11/pybind11.h>

#include <string>
#include <vector>

#include "dynains/io/recording.hpp"

namespace dynains::python {

/// Options with the keyword arguments `values`. Throws ConfigError for an unknown name,
/// TypeError for a value that the argument does not take, IoError for a file of an extrinsic
/// calibration.
RecordingOptions to_recording_options(const pybind11::dict& values);

std::vector<std::string> recording_setting_names();

/// The keyword arguments as flags of the program, {"--pose-shift": "1"}, which reports of runs
/// hold.
pybind11::dict to_flags(const pybind11::dict& values);
/// The keyword arguments that flags stand for; their values are text.
pybind11::dict from_flags(const pybind11::dict& flags);

/// Name, values and meaning of each keyword argument, one a line, for docstrings.
std::string describe_recording_settings();

}  // namespace dynains::python
