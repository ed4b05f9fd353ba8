#include "settings.hpp"

#include <algorithm>

#include "arrays.hpp"
#include "run/recording_settings.hpp"

namespace dynains::python {
namespace {

using program::RecordingSettings;

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

RecordingOptions to_recording_options(const py::dict& values) {
  RecordingSettings settings;
  for (const auto& [key, value] : values) {
    const std::string name = py::str(key);
    if (!assign_setting(settings, name, value)) throw ConfigError("unknown parameter " + name);
  }
  return settings.checked();
}

py::dict to_flags(const py::dict& values) {
  py::dict flags;
  for (const auto& [key, value] : values) {
    const std::string text = to_text(value);
    if (value.is_none() || text == "false") continue;
    std::string flag = "--" + py::str(key).cast<std::string>();
    std::replace(flag.begin(), flag.end(), '_', '-');
    flags[flag.c_str()] = text;
  }
  return flags;
}

py::dict from_flags(const py::dict& flags) {
  py::dict values;
  for (const auto& [flag, value] : flags) {
    std::string name = py::str(flag);
    if (name.rfind("--", 0) == 0) name.erase(0, 2);
    std::replace(name.begin(), name.end(), '-', '_');
    values[name.c_str()] = value;
  }
  return values;
}

}  // namespace dynains::python
