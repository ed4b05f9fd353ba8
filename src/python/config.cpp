#include <pybind11/numpy.h>

#include <algorithm>
#include <string>

#include "arrays.hpp"
#include "dynains/compiled_remover.hpp"
#include "settings.hpp"

namespace dynains::python {
namespace {

using Config = DynaInsRemover::Config;

py::list list_parameters() {
  py::list result;
  const Config defaults;
  Config::visit_sections(defaults, [&](const char* section, const auto& fields) {
    std::decay_t<decltype(fields)>::visit(fields, [&](const auto& parameter) {
      py::dict entry;
      entry["name"] = parameter.name;
      entry["section"] = section;
      entry["default"] = plain_value(parameter.value);
      entry["min"] = parameter.bounds.min;
      entry["max"] = parameter.bounds.max;
      using Value = std::remove_const_t<std::remove_reference_t<decltype(parameter.value)>>;
      entry["values"] = py::none();
      if constexpr (std::is_enum_v<Value>) entry["values"] = value_names(Value());
      entry["unit"] = parameter.unit;
      entry["help"] = parameter.help;
      result.append(entry);
    });
  });
  return result;
}

std::string represent(const Config& config) {
  const py::dict defaults = to_dict(Config());
  std::string text = "dynains.Config(";
  const char* separator = "";
  for (const auto& [name, value] : to_dict(config)) {
    if (value.equal(defaults[name])) continue;
    text += separator + name.cast<std::string>() + '=' + py::repr(value).cast<std::string>();
    separator = ", ";
  }
  return text + ')';
}

py::list sensors_of(const Config& config) {
  py::list poses;
  for (const Pose& pose : config.sensors) poses.append(to_array(pose));
  return poses;
}

void set_sensors(Config& config, const py::list& poses) {
  Config result = config;
  result.sensors.clear();
  for (const py::handle pose : poses) {
    try {
      result.sensors.push_back(to_pose(pose));
    } catch (const PoseError& error) {
      throw ConfigError("sensors[" + std::to_string(result.sensors.size()) + "]: " + error.what());
    }
  }
  result.validate();
  config = result;
}

bool are_equal(const Config& a, const Config& b) {
  const auto is_same = [](const Pose& x, const Pose& y) { return x.matrix() == y.matrix(); };
  return to_dict(a).equal(to_dict(b)) && std::equal(a.sensors.begin(), a.sensors.end(),
                                                    b.sensors.begin(), b.sensors.end(), is_same);
}

}  // namespace

void bind_config(py::module_& module) {
  py::class_<Config> config(module, "Config",
                            "All parameters by name: Config(window=6), config.tau_s = 0.5. Bounds "
                            "are checked at once; Config.parameters() lists everything.");
  config.def(py::init([](const py::kwargs& values) {
               Config result;
               assign_all(result, values);
               return result;
             }),
             "Defaults, with the parameters that are named set.");
  config.def_property(
      "sensors", &sensors_of, &set_sensors,
      "Poses of the sensors in the frame of the pushed clouds, each (4, 4): one, the identity.");
  const auto add_preset = [&](const char* name, Config (*preset)(), const char* help) {
    config.def_static(
        name,
        [preset](const py::kwargs& values) {
          Config result = preset();
          assign_all(result, values);
          return result;
        },
        help);
  };
  add_preset("paper", &Config::paper, "The paper to the letter, with its published parameters.");
  add_preset("published", &Config::published,
             "The paper's public implementation, where it departs from the text.");
  add_preset("offline", &Config::offline,
             "For recordings: verdicts wait for more later scans, at the cost of memory.");
  add_properties<Config>(config);
  config.def("to_dict", &to_dict<Config>, "Values by name.");
  config.def("validate", &Config::validate, "Raises ConfigError if parameters contradict.");
  config.def_static("parameters", &list_parameters,
                    "Name, section, default, bounds or values, unit and help of every parameter.");
  config.def("__eq__", &are_equal, py::arg("other"),
             py::is_operator());  // with anything else: not equal
  config.def(
      py::pickle([](const Config& self) { return py::make_tuple(to_dict(self), sensors_of(self)); },
                 [](const py::tuple& state) {
                   Config result;
                   assign_all(result, state[0].cast<py::dict>());
                   set_sensors(result, state[1].cast<py::list>());
                   return result;
                 }));
  config.def("__repr__", [](const Config& self) { return represent(self); });
}

}  // namespace dynains::python
