#include <pybind11/stl/filesystem.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <sstream>
#include <string>

#include "arrays.hpp"
#include "bindings.hpp"
#include "dynains/simulation/simulator.hpp"
#include "dynains/simulation/write_sequence.hpp"
#include "settings.hpp"

namespace dynains::python {
namespace {

using simulation::SimulatedScan;
using simulation::Simulator;

struct ScanOfArrays {
  double time;
  py::array_t<float> points;
  py::array_t<std::uint32_t> labels;
  py::array_t<double> T_world_sensor;
};

Simulator make_simulator(const std::string& scene, const std::string& sensor,
                         const std::string& labelling, const py::kwargs& parameters) {
  simulation::Config config;
  assign_all(config, parameters);
  assign_all(config, py::dict(py::arg("scene") = scene, py::arg("sensor") = sensor,
                              py::arg("labelling") = labelling));
  const py::gil_scoped_release release;
  return Simulator(config);
}

ScanOfArrays scan_of(Simulator& simulator, py::ssize_t index) {
  const auto size = static_cast<py::ssize_t>(simulator.size());
  if (index < 0) index += size;
  if (index < 0 || index >= size) throw py::index_error("the sequence has no such scan");
  SimulatedScan scan = simulator.scan(static_cast<std::size_t>(index));
  return {scan.time, to_array(std::move(scan.xyzi), 4), to_array(std::move(scan.labels)),
          to_array(scan.T_world_sensor_noisy)};
}

void write(Simulator& simulator, const std::filesystem::path& folder) {
  simulation::write_sequence(simulator, folder, [](std::size_t, std::size_t) {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    return true;
  });
}

std::string represent(const ScanOfArrays& scan) {
  std::ostringstream text;
  text << "<dynains.SimulatedScan: " << scan.points.shape(0) << " points at " << scan.time << " s>";
  return text.str();
}

std::string represent(const Simulator& simulator) {
  const simulation::Config& config = simulator.config();
  std::ostringstream text;
  text << "<dynains.Simulator: " << simulator.size() << " scans of scene "
       << plain_value(config.scene) << ", sensor " << plain_value(config.sensor) << ", seed "
       << config.seed << '>';
  return text.str();
}

}  // namespace

void bind_simulation(py::module_& module) {
  py::class_<ScanOfArrays>(module, "SimulatedScan", "One simulated scan.")
      .def_readonly("time", &ScanOfArrays::time, "s, 0 for the first scan.")
      .def_readonly("points", &ScanOfArrays::points,
                    "(N, 4) float32: x y z (m, sensor frame), reflectivity.")
      .def_readonly("labels", &ScanOfArrays::labels,
                    "(N,) uint32, class and instance of SemanticKITTI.")
      .def_readonly("T_world_sensor", &ScanOfArrays::T_world_sensor,
                    "(4, 4) float64, with the noise that was asked for.")
      .def("__repr__", [](const ScanOfArrays& scan) { return represent(scan); });

  const std::string doc =
      "A labelled street, measured by ray casting: simulator[i] is scan i.\n\nParameters by "
      "name:\n" +
      describe_settings<simulation::Config>();
  py::class_<Simulator>(module, "Simulator", doc.c_str())
      .def(py::init(&make_simulator), py::arg("scene") = "urban", py::arg("sensor") = "hdl64",
           py::arg("labelling") = "ever", "Raises ConfigError for unknown names and other values.")
      .def("__len__", &Simulator::size)
      .def("__getitem__", &scan_of, py::arg("index"), "Scan `index` as SimulatedScan.")
      .def("write", &write, py::arg("folder"),
           "Writes the sequence in the format of SemanticKITTI, as the program `dynains simulate`; "
           "the folder is created. Raises IoError.")
      .def("__repr__", [](const Simulator& simulator) { return represent(simulator); });
}

}  // namespace dynains::python
