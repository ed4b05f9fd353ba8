#include <pybind11/stl.h>

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

  const Diagnosis& diagnosis() const { return check.diagnosis; }
};

const char* name_of(PoseVerdict verdict) {
  constexpr std::array<const char*, 6> kNames{"agree",     "inexact",  "no motion",
                                              "otherwise", "disagree", "unknown"};
  static_assert(static_cast<std::size_t>(PoseVerdict::kUnknown) + 1 == kNames.size());
  return kNames.at(static_cast<std::size_t>(verdict));
}

/// The keyword arguments of a proposal such as `--invert-poses --pose-units mm`.
py::dict to_options(const std::string& proposal) {
  py::dict flags;
  std::string flag;
  for (const py::handle& word : py::module_::import("shlex").attr("split")(proposal)) {
    const std::string text = py::str(word);
    if (text.rfind("--", 0) == 0) {
      flag = text;
      flags[flag.c_str()] = true;
    } else {
      flags[flag.c_str()] = text;
    }
  }
  return from_flags(flags);
}

CheckedRecording check_by_name(const py::object& recording, const py::kwargs& options) {
  const std::shared_ptr<SharedRecording> shared = to_recording(recording, options);
  CheckedRecording result;
  result.check = shared->read(program::check_recording);
  result.path = shared->get().folder().string();
  result.options = shared->options().attr("copy")();
  for (const auto& [name, value] : to_options(result.check.flags)) {
    result.options[name] = value;
  }
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

}  // namespace

void bind_check(py::module_& module) {
  const auto registered = [](const Diagnosis& d, double value) {
    return d.registered_pairs > 0 ? std::optional<double>(value) : std::nullopt;
  };
  const auto mounted = [](const Diagnosis& d, double value) {
    return d.mounting.known ? std::optional<double>(value) : std::nullopt;
  };
  py::class_<CheckedRecording> diagnosis(
      module, "Diagnosis", "What check() found. Its text is that of the program `dynains check`.");
  const auto add = [&](const char* name, auto value_of, const char* doc) {
    diagnosis.def_property_readonly(
        name, [value_of](const CheckedRecording& self) { return value_of(self.diagnosis()); }, doc);
  };
  diagnosis
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
          "The verdict in words, and what to do.");
  add(
      "verdict", [](const Diagnosis& d) { return name_of(d.verdict); },
      "'agree', 'inexact', 'no motion', 'otherwise' (under other options), 'disagree' or "
      "'unknown'.");
  add(
      "translation_error",
      [registered](const Diagnosis& d) { return registered(d, d.translation_error); },
      "m, error of the poses from one scan to the next by registration; None if unknown.");
  add(
      "rotation_error",
      [registered](const Diagnosis& d) { return registered(d, 180.0 / M_PI * d.rotation_error); },
      "deg, likewise.");
  add(
      "agreement", [](const Diagnosis& d) { return d.as_given.share; },
      "Share of the points of two scans that agree under the poses, 0 to 1.");
  add(
      "scan_files", [](const Diagnosis& d) { return d.scan_files; }, "Number of files of scans.");
  add(
      "pose_rows", [](const Diagnosis& d) { return d.pose_rows; }, "Number of poses.");
  add(
      "scans", [](const Diagnosis& d) { return d.scans; }, "Number of scans with a pose.");
  add(
      "period", [](const Diagnosis& d) { return d.period; }, "s from scan to scan, median.");
  add(
      "points", [](const Diagnosis& d) { return d.points; }, "Points per scan, mean.");
  add(
      "invalid_share", [](const Diagnosis& d) { return d.invalid_share; },
      "Share of points that are NaN, infinite or all zero, 0 to 1.");
  add(
      "ego_share", [](const Diagnosis& d) { return d.ego_share; },
      "Share of valid points nearer than 2 m, 0 to 1.");
  add(
      "farthest", [](const Diagnosis& d) { return d.farthest; }, "m, 99 % of ranges are shorter.");
  add(
      "step", [](const Diagnosis& d) { return d.step; }, "m from scan to scan, median.");
  add(
      "longest_step", [](const Diagnosis& d) { return d.longest_step; },
      "m from scan to scan, maximum.");
  add(
      "height", [mounted](const Diagnosis& d) { return mounted(d, d.mounting.height); },
      "m, sensor over the ground; None if no ground was found.");
  add(
      "tilt", [mounted](const Diagnosis& d) { return mounted(d, d.mounting.tilt()); },
      "deg, of the sensor; None if no ground was found.");
  diagnosis.def("__repr__", [](const CheckedRecording& checked) { return represent(checked); });

  const std::string doc =
      "Tells in seconds whether a recording will work, and which options it needs.\n\n"
      "recording: a Recording, or its path and by name:\n" +
      describe_settings<program::RecordingSettings>() +
      "Returns a Diagnosis. Raises IoError if a file is broken.";
  module.def("check", &check_by_name, py::arg("recording"), doc.c_str());
}

}  // namespace dynains::python
