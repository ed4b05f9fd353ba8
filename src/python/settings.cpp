#include "settings.hpp"

#include "arrays.hpp"

namespace dynains::python {
namespace {

using run::RecordingSettings;

std::string joined(const py::object& numbers) {
  std::string text;
  for (const py::handle& number : numbers) {
    text += (text.empty() ? "" : " ") +
            py::repr(py::float_(py::reinterpret_borrow<py::object>(number))).cast<std::string>();
  }
  return text;
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

RecordingSettings to_recording_settings(const py::dict& values) {
  RecordingSettings settings;
  for (const auto& [key, value] : values) {
    const std::string name = py::str(key);
    if (!has_setting<RecordingSettings>(name)) throw ConfigError("unknown parameter " + name);
    if (!value.is_none()) settings.assign("--" + run::flag_name(name), to_text(value), name);
  }
  return settings;
}

}  // namespace dynains::python
