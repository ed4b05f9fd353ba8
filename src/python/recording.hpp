// A recording of Python.
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <string>

#include "dynains/io/recording.hpp"
#include "run/settings/recording_settings.hpp"

namespace dynains::python {

struct SharedRecording {
  const Recording recording;     ///< several threads may read
  const pybind11::dict options;  ///< keyword arguments that it was opened with
  const run::RecordingSettings settings;

  /// Calls `work` with the recording, without the interpreter's lock.
  template <class Work>
  auto read(Work&& work) const {
    const pybind11::gil_scoped_release release;
    return work(recording);
  }
};

/// Opens a recording with keyword arguments, or takes an open one, to which none may be given.
std::shared_ptr<SharedRecording> to_recording(const pybind11::object& recording,
                                              const pybind11::dict& options);

/// A RuntimeWarning; throws if the caller has made an error of it.
void warn(const std::string& text);
/// Recording::warnings() as such.
void show_warnings(const Recording& recording);

}  // namespace dynains::python
