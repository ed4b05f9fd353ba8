// The parts of the module, one file each.
#pragma once

#include <pybind11/pybind11.h>

namespace dynains::python {

void bind_config(pybind11::module_& module);
void bind_remover(pybind11::module_& module);
void bind_evaluation(pybind11::module_& module);
void bind_recording(pybind11::module_& module);
void bind_check(pybind11::module_& module);
void bind_run(pybind11::module_& module);

}  // namespace dynains::python
