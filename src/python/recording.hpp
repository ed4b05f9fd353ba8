// A recording of Python.
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <string>
#include <utility>

#include "dynains/io/recording.hpp"
#include "run/settings/recording_settings.hpp"

namespace dynains::python {

class SharedRecording {
 public:
  SharedRecording(Recording recording, pybind11::dict options, run::RecordingSettings settings)
      : recording_(std::move(recording)),
        options_(std::move(options)),
        settings_(std::move(settings)) {}

  /// Several threads may read.
  const Recording& get() const { return recording_; }
  /// The keyword arguments that it was opened with.
  const pybind11::dict& options() const { return options_; }
  const run::RecordingSettings& settings() const { return settings_; }

  /// Calls `work` with the recording, without the interpreter's lock.
  template <class Work>
  auto read(Work&& work) const {
    const pybind11::gil_scoped_release release;
    return work(recording_);
  }

 private:
  Recording recording_;
  pybind11::dict options_;
  run::RecordingSettings settings_;
};

/// Opens a recording with keyword arguments, or takes an open one, to which none may be given.
std::shared_ptr<SharedRecording> to_recording(const pybind11::object& recording,
                                              const pybind11::dict& options);

/// A RuntimeWarning; throws if the caller has made an error of it.
void warn(const std::string& text);
/// Recording::warnings() as such.
void show_warnings(const Recording& recording);

}  // namespace dynains::python
