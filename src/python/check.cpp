#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "bindings.hpp"
#include "recording.hpp"
#include "run/remarks/recording_check.hpp"
#include "run/settings/recording_settings.hpp"
#include "settings.hpp"

namespace dynains::python {
namespace {

// Values of the properties of Diagnosis, and the text that represents it.
struct CheckedRecording {
  bool passed;
  py::dict options;
  std::string advice;
  std::string verdict;
  std::optional<double> translation_error, rotation_error;
  py::dict measured;
  std::string text;
};

/// Adds the keyword arguments of a proposal such as `--invert-poses --pose-units mm`.
void add_options(py::dict& options, const std::string& proposal) {
  std::string name;
  for (const py::handle& word : py::module_::import("shlex").attr("split")(proposal)) {
    const std::string text = py::str(word);
    const bool is_flag = text.rfind("--", 0) == 0;
    if (is_flag) {
      name = text.substr(2);
      std::replace(name.begin(), name.end(), '-', '_');
    }
    options[name.c_str()] = is_flag ? py::object(py::bool_(true)) : py::str(text);
  }
}

/// The call of Recording with these options.
std::string call_text(const std::string& path, const py::dict& options) {
  std::string text = "dynains.Recording(" + py::repr(py::str(path)).cast<std::string>();
  for (const auto& [name, value] : options) {
    const py::object shown = py::hasattr(value, "__fspath__")
                                 ? py::module_::import("os").attr("fspath")(value)
                                 : py::reinterpret_borrow<py::object>(value);
    text += ", " + py::str(name).cast<std::string>() + '=' + py::repr(shown).cast<std::string>();
  }
  return text + ')';
}

std::string without_last_newlines(const std::string& text) {
  return text.substr(0, text.find_last_not_of('\n') + 1);
}

py::dict measured(const Diagnosis& d) {
  py::dict values;
  values["scan_files"] = d.scan_files;
  values["pose_rows"] = d.pose_rows;
  values["scans"] = d.scans;
  values["period"] = d.period;
  values["points"] = d.points;
  values["invalid_share"] = d.invalid_share;
  values["ego_share"] = d.ego_share;
  values["farthest"] = d.farthest;
  values["step"] = d.step;
  values["longest_step"] = d.longest_step;
  values["agreement"] = d.as_given.share;
  if (d.mounting.known) {
    values["height"] = d.mounting.height;
    values["tilt"] = d.mounting.tilt();
  }
  return values;
}

CheckedRecording check_by_name(const py::object& recording, const py::kwargs& options) {
  const std::shared_ptr<SharedRecording> shared = to_recording(recording, options);
  const run::RecordingCheck check = shared->read(run::check_recording);
  const Diagnosis& d = check.diagnosis;
  CheckedRecording result{check.passed,
                          shared->options().attr("copy")(),
                          without_last_newlines(check.advice + check.remark),
                          plain_value(d.verdict),
                          {},
                          {},
                          measured(d),
                          check.findings + check.advice};
  add_options(result.options, check.flags);
  if (d.registered_pairs > 0) {
    result.measured["error_span"] = d.error_span;
    result.translation_error = d.translation_error;
    result.rotation_error = 180.0 / M_PI * d.rotation_error;
  }
  if (!check.flags.empty()) {
    result.text += "    " + call_text(shared->get().folder().string(), result.options) + '\n';
  }
  result.text = without_last_newlines(result.text + check.remark);
  return result;
}

}  // namespace

void bind_check(py::module_& module) {
  py::class_<CheckedRecording>(
      module, "Diagnosis", "What check() found. Its text is that of the program `dynains check`.")
      .def_readonly("passed", &CheckedRecording::passed,
                    "Whether the recording will work with the options that it was opened with.")
      .def_readonly(
          "options", &CheckedRecording::options,
          "The options that a Recording should be opened with: those given and those proposed.")
      .def_readonly("advice", &CheckedRecording::advice, "The verdict in words, and what to do.")
      .def_readonly(
          "verdict", &CheckedRecording::verdict,
          "'agree', 'inexact', 'no motion', 'otherwise' (under other options), 'disagree' or "
          "'unknown'.")
      .def_readonly("translation_error", &CheckedRecording::translation_error,
                    "m, error of the poses over measured['error_span'] scans by registration; None "
                    "if unknown.")
      .def_readonly("rotation_error", &CheckedRecording::rotation_error, "deg, likewise.")
      .def_readonly(
          "measured", &CheckedRecording::measured,
          "By name: scan_files, pose_rows, scans (with a pose); period (s), step, longest_step (m) "
          "from scan to scan; points (per scan); invalid_share, ego_share (nearer than 2 m), "
          "agreement (of two scans under the poses), 0 to 1; error_span (scans, more than 1 if "
          "errors add up); farthest (m, 99 % of ranges are shorter); height (m, over the ground), "
          "tilt (deg), unless no ground was found.")
      .def("__repr__", [](const CheckedRecording& checked) { return checked.text; });

  const std::string doc =
      "Reports within seconds whether a recording will work, and which options it needs.\n\n"
      "recording: a Recording, or its path and by name:\n" +
      describe_settings<run::RecordingSettings>() +
      "Returns a Diagnosis. Raises IoError if a file is broken.";
  module.def("check", &check_by_name, py::arg("recording"), doc.c_str());
}

}  // namespace dynains::python
