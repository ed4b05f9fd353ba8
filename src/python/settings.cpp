#include "settings.hpp"

#include <cmath>

namespace dynains::python {
namespace {

// The number that a text stands for, or the value itself.
py::object parse(const py::handle& value) {
  if (!py::isinstance<py::str>(value)) return py::reinterpret_borrow<py::object>(value);
  PyObject* const number = PyFloat_FromString(value.ptr());
  if (number != nullptr) return py::reinterpret_steal<py::object>(number);
  PyErr_Clear();
  throw py::cast_error();
}

}  // namespace

double to_number(const py::handle& value, double least, double most) {
  const auto number = parse(value).cast<double>();
  if (!std::isfinite(number) || number < least || number > most) throw py::cast_error();
  return number;
}

std::int64_t to_whole_number(const py::handle& value, std::int64_t least, std::int64_t most) {
  const double number = to_number(value, static_cast<double>(least), static_cast<double>(most));
  if (std::trunc(number) != number) throw py::cast_error();
  return static_cast<std::int64_t>(number);
}

}  // namespace dynains::python
