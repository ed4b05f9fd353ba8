#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "dynains/errors.hpp"
#include "run/remarks/recording_check.hpp"
#include "run/settings/recording_settings.hpp"
#include "settings.hpp"

namespace dynains::python {
namespace {

using RecordingPointer = std::shared_ptr<SharedRecording>;

RecordingPointer open(const std::filesystem::path& path, const py::dict& values) {
  const run::RecordingSettings settings = to_recording_settings(values);
  std::optional<Recording> recording;
  {
    const py::gil_scoped_release release;
    recording.emplace(path, settings.checked());
  }
  return std::make_shared<SharedRecording>(
      SharedRecording{std::move(*recording), values, settings});
}

/// One scan, whose labels are read when they are asked for.
struct ScanOfRecording {
  ScanOfRecording(RecordingPointer opened, std::size_t i)
      : recording(std::move(opened)),
        index(i),
        name(recording->recording.name(i)),
        time(recording->recording.time(i)),
        T_world_sensor(to_array(recording->recording.T_world_sensor(i))) {
    RecordedScan scan = recording->read([i](const Recording& open) { return open.read_scan(i); });
    points = to_array(std::move(scan.xyzi), 4);
    if (!scan.ring.empty()) rings = to_array(std::move(scan.ring));
    if (!scan.time.empty()) times = to_array(std::move(scan.time));
  }

  py::object intensity() const {
    if (!recording->recording.columns().intensity) return py::none();
    return points[py::make_tuple(py::ellipsis(), 3)];
  }

  py::object read_labels() {
    if (labels.is_none() && recording->recording.has_labels()) {
      labels =
          to_array(recording->read([&](const Recording& open) { return open.read_labels(index); }));
    }
    return labels;
  }

  std::string represent() const {
    std::ostringstream text;
    text << "<dynains.RecordedScan: " << name << " at " << time << " s, " << points.shape(0)
         << " points>";
    return text.str();
  }

  RecordingPointer recording;
  std::size_t index;
  std::string name;
  double time;
  py::array_t<double> T_world_sensor;
  py::array_t<float> points;
  py::object rings = py::none(), times = py::none(), labels = py::none();
};

std::string joined(const py::object& numbers) {
  std::string text;
  for (const py::handle& number : numbers) {
    text += (text.empty() ? "" : " ") +
            py::repr(py::float_(py::reinterpret_borrow<py::object>(number))).cast<std::string>();
  }
  return text;
}

ScanOfRecording scan_of(const RecordingPointer& recording, py::ssize_t index) {
  const auto size = static_cast<py::ssize_t>(recording->recording.size());
  if (index < 0) index += size;
  if (index < 0 || index >= size) throw py::index_error("the recording has no such scan");
  return {recording, static_cast<std::size_t>(index)};
}

py::array_t<double> poses_of(const SharedRecording& recording) {
  py::array_t<double> poses({recording.recording.size(), std::size_t{4}, std::size_t{4}});
  using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
  for (std::size_t i = 0; i < recording.recording.size(); ++i) {
    const auto row = static_cast<py::ssize_t>(i);
    Eigen::Map<RowMajor>(poses.mutable_data(row)) = recording.recording.T_world_sensor(i).matrix();
  }
  return poses;
}

std::string represent(const SharedRecording& recording) {
  const Recording& open = recording.recording;
  std::ostringstream text;
  text << "<dynains.Recording: " << open.size() << " scans";
  if (open.size() > 0) text << " in " << open.time(open.size() - 1) - open.time(0) << " s";
  text << " of " << open.folder().string() << '>';
  return text.str();
}

}  // namespace

std::string to_text(const py::handle& value) {
  if (py::isinstance<py::str>(value) || py::hasattr(value, "__fspath__")) {
    return py::module_::import("os").attr("fsdecode")(value).cast<std::string>();
  }
  const py::array array = py::array::ensure(value);
  if (array && array.ndim() == 1) return joined(array);
  if (array && array.ndim() > 1) {
    const Pose T = to_pose(value);
    const detail::Quaternion q(T.linear());
    const Eigen::Vector3d t = T.translation();
    return joined(py::make_tuple(t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()));
  }
  const auto text = py::str(value).cast<std::string>();
  if (text == "True") return "true";
  return text == "False" ? "false" : text;
}

run::RecordingSettings to_recording_settings(const py::dict& values) {
  run::RecordingSettings settings;
  for (const auto& [key, value] : values) {
    const std::string name = py::str(key);
    const bool is_known = assign_setting(settings, name, py::none());
    if (!is_known) throw ConfigError("unknown parameter " + name);
    if (!value.is_none()) settings.assign("--" + run::flag_name(name), to_text(value), name);
  }
  return settings;
}

RecordingPointer to_recording(const py::object& recording, const py::dict& options) {
  if (!py::isinstance<SharedRecording>(recording)) {
    return open(recording.cast<std::filesystem::path>(), options);
  }
  if (!options.empty()) {
    throw py::type_error(
        "options of an open recording: give its path, or the options where it is opened");
  }
  return recording.cast<RecordingPointer>();
}

void warn(const std::string& text) {
  if (PyErr_WarnEx(PyExc_RuntimeWarning, text.c_str(), 1) != 0) throw py::error_already_set();
}

void show_warnings(const Recording& recording) {
  for (const std::string& text : recording.warnings()) {
    warn(recording.folder().string() + ": " + text);
  }
}

void bind_recording(py::module_& module) {
  py::class_<ScanOfRecording>(module, "RecordedScan", "One scan of a recording.")
      .def_readonly("name", &ScanOfRecording::name, "File name without extension.")
      .def_readonly("time", &ScanOfRecording::time, "s")
      .def_readonly("T_world_sensor", &ScanOfRecording::T_world_sensor, "(4, 4) float64.")
      .def_readonly("points", &ScanOfRecording::points,
                    "(N, 4) float32: x y z (m, sensor frame), intensity (0 without one).")
      .def_property_readonly("intensity", &ScanOfRecording::intensity,
                             "(N,) float32, a view of the points; None if scans have none.")
      .def_readonly("rings", &ScanOfRecording::rings,
                    "(N,) uint16, number of the beam; None if scans have none.")
      .def_readonly("times", &ScanOfRecording::times,
                    "(N,) float64, time of each point in the unit of the file; None if "
                    "scans have none.")
      .def_property_readonly("labels", &ScanOfRecording::read_labels,
                             "(N,) uint32, class and instance of SemanticKITTI, read at the first "
                             "use; None if the recording has none. Raises IoError.")
      .def("__repr__", &ScanOfRecording::represent);

  const std::string doc =
      "Recorded scans with poses: recording[i] is scan i, read when it is asked for.\n\n"
      "path: folder of KITTI, SemanticKITTI or nuScenes, folder of .pcd, .ply, .bin, .las, .npy, "
      ".xyz or .csv files, or log of ROS (.mcap, .db3, .bag, or a folder with metadata.yaml).\n"
      "What the files mean, by name (dynains.check finds out):\n" +
      describe_settings<run::RecordingSettings>();
  const auto of = [](auto member) {
    return [member](const SharedRecording& recording) { return (recording.recording.*member)(); };
  };
  const auto of_scans = [](auto member) {
    return [member](const SharedRecording& recording) {
      std::vector<std::decay_t<decltype((recording.recording.*member)(0))>> values;
      for (std::size_t i = 0; i < recording.recording.size(); ++i) {
        values.push_back((recording.recording.*member)(i));
      }
      return values;
    };
  };
  py::class_<SharedRecording, RecordingPointer>(module, "Recording", doc.c_str())
      .def(
          py::init([](const std::filesystem::path& path, const py::kwargs& options) {
            RecordingPointer recording = open(path, py::dict(options));
            show_warnings(recording->recording);
            return recording;
          }),
          py::arg("path"),
          "Raises IoError for files that cannot be read, ConfigError for unknown options. Warns if "
          "scans are left out.")
      .def("__len__", of(&Recording::size))
      .def("__getitem__", &scan_of, py::arg("index"),
           "Scan `index` as RecordedScan. Raises IoError.")
      .def_property_readonly("path", of(&Recording::folder), "Folder or log.")
      .def_property_readonly(
          "options",
          [](const SharedRecording& recording) {
            return py::dict(recording.options.attr("copy")());
          },
          "The options that it was opened with.")
      .def_property_readonly(
          "frame",
          [](const SharedRecording& recording) { return plain_value(recording.recording.frame()); },
          "Frame of the points in the files, 'sensor' or 'world'.")
      .def_property_readonly("names", of_scans(&Recording::name), "Name of each scan.")
      .def_property_readonly(
          "times",
          [times = of_scans(&Recording::time)](const SharedRecording& recording) {
            return to_array(times(recording));
          },
          "(scans,) float64, s, strictly increasing.")
      .def_property_readonly("poses", &poses_of, "(scans, 4, 4) float64, T_world_sensor.")
      .def_property_readonly(
          "has_labels",
          [](const SharedRecording& recording) { return recording.recording.has_labels(); },
          "Whether scans have labels.")
      .def_property_readonly("missing_poses", of(&Recording::missing_pose_count),
                             "Number of scans that are left out because they have no pose.")
      .def_property_readonly("early_end", of(&Recording::early_end),
                             "Path, position and reason if a log is cut off, else None.")
      .def_property_readonly(
          "notes", of(&Recording::notes),
          "What was chosen or left out when the recording was opened, a sentence each.")
      .def("__repr__", [](const SharedRecording& recording) { return represent(recording); });
}

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
                          shared->options.attr("copy")(),
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
    result.text += "    " + call_text(shared->recording.folder().string(), result.options) + '\n';
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
