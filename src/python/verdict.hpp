// Verdicts that outlive the next call of the remover.
#pragma once

#include <pybind11/numpy.h>

#include <cstdint>
#include <vector>

#include "arrays.hpp"
#include "dynains/points.hpp"
#include "dynains/verdict.hpp"

namespace dynains::python {

/// A copy of a span.
template <class To, class From>
py::array_t<To> to_array_of(Span<const From> values) {
  std::vector<To> copy;
  copy.reserve(values.size());
  for (const From value : values) copy.push_back(static_cast<To>(value));
  return to_array(std::move(copy));
}

/// ScanVerdict with arrays that Python owns.
struct Verdict {
  std::uint64_t scan;
  double time;
  py::array_t<double> T_world_sensor;
  py::array_t<std::uint8_t> labels;
  py::array_t<std::uint32_t> instances;
  py::array_t<float> beliefs;
  py::array_t<std::uint8_t> causes;

  explicit Verdict(const ScanVerdict& verdict)
      : scan(verdict.scan),
        time(verdict.time),
        T_world_sensor(to_array(verdict.T_world_sensor)),
        labels(to_array_of<std::uint8_t>(verdict.labels)),
        instances(to_array_of<std::uint32_t>(verdict.instances)),
        beliefs(to_array_of<float>(verdict.beliefs)),
        causes(to_array_of<std::uint8_t>(verdict.causes)) {}
};

}  // namespace dynains::python
