#include <pybind11/pybind11.h>

#include "dynains/errors.hpp"
#include "dynains/version.hpp"
#include "settings.hpp"

PYBIND11_MODULE(_dynains, module) {
  namespace py = pybind11;
  // Classes name the package as their module, as if they were defined in it.
  const py::object own_name = module.attr("__name__");
  module.attr("__name__") = "dynains";
  module.doc() =
      "Removes moving objects from LiDAR scans and maps, scan by scan.\n\n"
      "    remover = dynains.DynaInsRemover()\n"
      "    frame = remover.push(points, T_world_sensor, time)\n"
      "    moving = points[frame.newest.labels == dynains.Label.DYNAMIC]\n\n"
      "    dynains.run('drive.mcap', 'cleaned')\n"
      "    dynains.view('cleaned')\n\n"
      "Points are float32 or float64 arrays of shape (N, 3 to 64), metres, sensor frame, read\n"
      "where they lie. Poses are (4, 4). What is given out is the caller's own.";
  module.attr("__version__") = dynains::kVersionString;

  py::register_exception<dynains::ConfigError>(module, "ConfigError", PyExc_ValueError).doc() =
      "A parameter is unknown or out of its bounds.";
  py::register_exception<dynains::PoseError>(module, "PoseError", PyExc_ValueError).doc() =
      "A pose is no rigid transform, or a time does not increase.";
  py::register_exception<dynains::CloudError>(module, "CloudError", PyExc_ValueError).doc() =
      "An array of points has the wrong shape.";
  py::register_exception<dynains::IoError>(module, "IoError", PyExc_OSError).doc() =
      "A file cannot be read or written; the text names path, position and what was expected.";
  py::register_exception<dynains::UsageError>(module, "UsageError", PyExc_RuntimeError).doc() =
      "A call that the present state does not allow, such as a run into a folder in use.";

  dynains::python::bind_config(module);
  dynains::python::bind_remover(module);
  dynains::python::bind_evaluation(module);
  dynains::python::bind_recording(module);
  dynains::python::bind_check(module);
  dynains::python::bind_run(module);
  module.attr("__name__") = own_name;
}
