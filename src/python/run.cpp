#include "run/run.hpp"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <optional>
#include <string>

#include "dynains/errors.hpp"
#include "run/run_plan.hpp"
#include "run/write_view.hpp"
#include "settings.hpp"

namespace dynains::python {
namespace {

namespace fs = std::filesystem;
using run::RunOutcome;
using run::RunSettings;

// The checked arguments of run().
struct RunArguments {
  RunSettings settings;
  py::object progress;
  std::shared_ptr<SharedRecording> recording;
};

[[noreturn]] void refuse_value(const std::string& name, const py::handle& value,
                               const char* expected) {
  throw py::type_error(name + " = " + py::repr(value).cast<std::string>() + ": expected " +
                       expected);
}

constexpr const char* kObjects =
    "  preset: parameters to start from; 'default', 'offline', 'paper' or 'published'\n"
    "  config: all parameters, in place of a preset; a Config\n"
    "  progress: called with the numbers of finished scans and of all scans; a function\n";

/// Takes the settings of a run out of `values`. Returns the options of the recording.
py::dict take_settings(const py::kwargs& values, RunSettings& settings) {
  py::dict options;
  run::RecordingSettings of_recording;
  for (const auto& [key, value] : values) {
    const std::string name = py::str(key);
    if (assign_setting(settings, name, value)) continue;
    if (!assign_setting(of_recording, name, py::none())) {
      throw ConfigError("unknown parameter " + name);
    }
    options[key] = value;
  }
  return options;
}

void take_config(const py::object& preset, const py::object& config, RunSettings& settings) {
  const bool is_given = !config.is_none();
  if (is_given && !preset.is_none()) throw ConfigError("run: give preset or config, not both");
  const auto& names = run::preset_names();
  if (!preset.is_none()) settings.preset = to_text(preset);
  if (std::find(names.begin(), names.end(), settings.preset) == names.end()) {
    refuse_value("preset", preset, "'default', 'offline', 'paper' or 'published'");
  }
  if (is_given && !py::isinstance<DynaInsRemover::Config>(config)) {
    refuse_value("config", config, "a Config");
  }
  settings.config = is_given ? config.cast<DynaInsRemover::Config>()
                             : DynaInsRemover::Config::preset(settings.preset);
  settings.config.validate();
  settings.find_own_body = !is_given && !run::has_ranges_of_paper(settings.preset);
}

run::RunListener listen(const RunArguments& run) {
  run::RunListener listener;
  // The process is that of others, such as the kernel of a notebook.
  listener.second_signal = run::SecondSignal::kAsksAgain;
  listener.warn = [](const std::string& text) {
    const py::gil_scoped_acquire acquire;
    warn(text);
  };
  listener.progress = [&run](std::size_t done, std::size_t total) {
    const py::gil_scoped_acquire acquire;
    // Ctrl-C before the run began to listen to signals.
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (!run.progress.is_none()) run.progress(done, total);
  };
  return listener;
}

/// Raises what Python raises for a signal.
[[noreturn]] void raise_signal(const RunOutcome& outcome) {
  const std::string folder = outcome.outputs.folder.string();
  const std::string text = "the results of " + outcome.report["scans"].dump() + " scans stay in " +
                           folder + " until the next run";
  if (outcome.signal == SIGINT) {
    PyErr_SetString(PyExc_KeyboardInterrupt, text.c_str());
  } else {
    PyErr_SetObject(PyExc_SystemExit, py::int_(128 + outcome.signal).ptr());
  }
  throw py::error_already_set();
}

// Files and numbers of a run; counts are those of the report.
struct RunResult {
  fs::path folder;
  std::optional<fs::path> static_map, page;
  py::dict report;
};

RunArguments prepare(const py::object& recording, const fs::path& out, const py::object& preset,
                     const py::object& config, const py::object& progress,
                     const py::kwargs& values) {
  RunArguments arguments{{}, progress, nullptr};
  RunSettings& settings = arguments.settings;
  const py::dict options = take_settings(values, settings);
  take_config(preset, config, settings);
  if (!progress.is_none() && PyCallable_Check(progress.ptr()) == 0) {
    refuse_value("progress", progress, "a function");
  }
  settings.outputs.folder = out;
  run::check_settings(settings);
  arguments.recording = to_recording(recording, options);
  const SharedRecording& shared = *arguments.recording;
  if (!py::isinstance<SharedRecording>(recording)) show_warnings(shared.recording);
  settings.recording = shared.recording.folder().string();
  settings.recording_flags = shared.settings.flags;
  settings.recording_as_given = shared.settings.as_given(settings.recording);
  return arguments;
}

RunResult run(const py::object& recording, const fs::path& out, const py::object& preset,
              const py::object& config, const py::object& progress, const py::kwargs& values) {
  const RunArguments arguments = prepare(recording, out, preset, config, progress, values);
  const run::RunListener listener = listen(arguments);
  RunOutcome outcome;
  {
    const py::gil_scoped_release release;
    outcome = run::run(arguments.settings, arguments.recording->recording, listener);
  }
  if (outcome.signal != 0) raise_signal(outcome);
  const run::RunOutputs& outputs = outcome.outputs;
  RunResult result{outputs.folder, {}, {}, {}};
  if (!outputs.map.empty()) result.static_map = outputs.folder / outputs.map_name();
  if (outputs.write_page) result.page = outputs.folder / run::kResultNames.page;
  const py::object text = py::module_::import("pathlib")
                              .attr("Path")(outputs.folder / "report.json")
                              .attr("read_bytes")();
  result.report = py::module_::import("json").attr("loads")(text);
  return result;
}

std::string represent(const RunResult& result) {
  return "<dynains.RunResult: " + py::str(result.report["scans"]).cast<std::string>() +
         " scans in " + result.folder.string() + '>';
}

/// Writes the page of a finished run. The recording and its options are those of the run unless
/// they are given.
fs::path write_page(const fs::path& out, const py::object& recording, std::size_t max_points) {
  const auto open = [&](const run::ResultFolder& finished) {
    if (!recording.is_none()) {
      const py::gil_scoped_acquire acquire;
      return to_recording(recording, py::dict())->recording;
    }
    run::RecordingSettings settings;
    settings.complete(finished.marker().value("sequence_flags", nlohmann::ordered_json::object()));
    return Recording(finished.field<std::string>("/sequence"), settings.checked());
  };
  const py::gil_scoped_release release;
  return run::add_page(out, open, max_points);
}

}  // namespace

void bind_run(py::module_& module) {
  const auto count = [](const char* name) {
    return [name](const RunResult& result) { return py::object(result.report[name]); };
  };
  const auto file = [](const char* name) {
    return [name](const RunResult& result) { return result.folder / name; };
  };
  py::class_<RunResult>(module, "RunResult", "Results of a run.")
      .def_readonly("folder", &RunResult::folder, "Folder of the results.")
      .def_property_readonly("scans", count("scans"), "Number of scans.")
      .def_property_readonly("points", count("points"), "Number of points of all scans.")
      .def_property_readonly(
          "label_counts", count("labels"),
          "Number of points by label: invalid, out_of_range, ground, static, dynamic.")
      .def_readonly("static_map", &RunResult::static_map,
                    "File of the static map; None without a map.")
      .def_property_readonly("moving_points", file("dynamic_points.ply"),
                             "File of the moving points.")
      .def_property_readonly("labels", file("labels"),
                             "Folder of the labels, a file for each scan.")
      .def_property_readonly("picture", file(run::kResultNames.picture),
                             "Picture: before, after, removed.")
      .def_readonly("page", &RunResult::page, "Page for a browser; None unless view=True.")
      .def_readonly("report", &RunResult::report, "The content of report.json.")
      .def("__repr__", [](const RunResult& result) { return represent(result); });

  const std::string doc =
      "Removes what moves from a recorded sequence, as the program `dynains run`.\n\n"
      "recording: a Recording, or its path. out: folder for the results; created, must be empty.\n"
      "By name:\n" +
      std::string(kObjects) + describe_settings<RunSettings>() +
      "For the path of a recording also:\n" + describe_settings<run::RecordingSettings>() +
      "Returns a RunResult. Ctrl-C ends the run after the scan at hand and raises "
      "KeyboardInterrupt; the results so far stay in out.partial until the next run. Raises "
      "IoError, ConfigError, PoseError, and UsageError if another run writes to the folder. Warns "
      "by RuntimeWarning. Other threads run meanwhile.";
  module.def("run", &run, py::arg("recording"), py::arg("out"), py::kw_only(),
             py::arg("preset") = py::none(), py::arg("config") = py::none(),
             py::arg("progress") = py::none(), doc.c_str());
  // For dynains.view().
  module.def("_write_page", &write_page, py::arg("out"), py::arg("recording") = py::none(),
             py::arg("max_points") = run::kDefaultViewPoints);
}

}  // namespace dynains::python
