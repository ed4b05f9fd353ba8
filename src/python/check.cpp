#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "bindings.hpp"
#include "parameters.hpp"
#include "recording.hpp"
#include "run/recording_check.hpp"
#include "run/recording_settings.hpp"
#include "settings.hpp"

namespace dynains::python {
namespace {

using program::RecordingCheck;

// A RecordingCheck, with the options that its diagnosis proposes.
struct CheckedRecording {
  RecordingCheck check;
  std::string path;
  py::dict options;
};

const char* name_of(PoseVerdict verdict) {
  constexpr std::array<const char*, 6> kNames{"agree",     "inexact",  "no motion",
                                              "otherwise", "disagree", "unknown"};
  static_assert(static_cast<std::size_t>(PoseVerdict::kUnknown) + 1 == kNames.size());
  return kNames.at(static_cast<std::size_t>(verdict));
}

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

CheckedRecording check_by_name(const py::object& recording, const py::kwargs& options) {
  const std::shared_ptr<SharedRecording> shared = to_recording(recording, options);
  CheckedRecording result;
  result.check = shared->read(program::check_recording);
  result.path = shared->get().folder().string();
  result.options = shared->options().attr("copy")();
  add_options(result.options, result.check.flags);
  return result;
}

std::string represent(const CheckedRecording& checked) {
  std::string text = checked.check.findings + checked.check.advice;
  if (!checked.check.flags.empty()) {
    text += "    dynains.Recording(" + py::repr(py::str(checked.path)).cast<std::string>();
    for (const auto& [name, value] : checked.options) {
      const py::object shown = py::hasattr(value, "__fspath__")
                                   ? py::module_::import("os").attr("fspath")(value)
                                   : py::reinterpret_borrow<py::object>(value);
      text += ", " + py::str(name).cast<std::string>() + '=' + py::repr(shown).cast<std::string>();
    }
    text += ")\n";
  }
  text += checked.check.remark;
  return text.substr(0, text.find_last_not_of('\n') + 1);
}

std::optional<double> if_registered(const CheckedRecording& checked, double value) {
  if (checked.check.diagnosis.registered_pairs == 0) return std::nullopt;
  return value;
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

}  // namespace

void bind_check(py::module_& module) {
  py::class_<CheckedRecording>(
      module, "Diagnosis", "What check() found. Its text is that of the program `dynains check`.")
      .def_property_readonly(
          "passed", [](const CheckedRecording& self) { return self.check.passed; },
          "Whether the recording will work with the options that it was opened with.")
      .def_property_readonly(
          "options",
          [](const CheckedRecording& self) { return py::dict(self.options.attr("copy")()); },
          "The options that a Recording should be opened with: those given and those proposed.")
      .def_property_readonly(
          "advice",
          [](const CheckedRecording& self) {
            const std::string text = self.check.advice + self.check.remark;
            return text.substr(0, text.find_last_not_of('\n') + 1);
          },
          "The verdict in words, and what to do.")
      .def_property_readonly(
          "verdict",
          [](const CheckedRecording& self) { return name_of(self.check.diagnosis.verdict); },
          "'agree', 'inexact', 'no motion', 'otherwise' (under other options), 'disagree' or "
          "'unknown'.")
      .def_property_readonly(
          "translation_error",
          [](const CheckedRecording& self) {
            return if_registered(self, self.check.diagnosis.translation_error);
          },
          "m, error of the poses from one scan to the next by registration; None if unknown.")
      .def_property_readonly(
          "rotation_error",
          [](const CheckedRecording& self) {
            return if_registered(self, 180.0 / M_PI * self.check.diagnosis.rotation_error);
          },
          "deg, likewise.")
      .def_property_readonly(
          "measured", [](const CheckedRecording& self) { return measured(self.check.diagnosis); },
          "By name: scan_files, pose_rows, scans (with a pose); period (s), step, longest_step (m) "
          "from scan to scan; points (per scan); invalid_share, ego_share (nearer than 2 m), "
          "agreement (of two scans under the poses), 0 to 1; farthest (m, 99 % of ranges are "
          "shorter); height (m, over the ground), tilt (deg), unless no ground was found.")
      .def("__repr__", [](const CheckedRecording& checked) { return represent(checked); });

  const std::string doc =
      "Tells in seconds whether a recording will work, and which options it needs.\n\n"
      "recording: a Recording, or its path and by name:\n" +
      describe_settings<program::RecordingSettings>() +
      "Returns a Diagnosis. Raises IoError if a file is broken.";
  module.def("check", &check_by_name, py::arg("recording"), doc.c_str());
}

}  // namespace dynains::python
