// Verdicts that outlive the next call of the remover.
#pragma once

#include <pybind11/numpy.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/verdict.hpp"

namespace dynains::python {

/// Copies of the spans of a ScanVerdict, which the next call of the remover overwrites.
struct OwnedVerdict {
  std::uint64_t scan;
  double time;
  Pose T_world_sensor;
  std::vector<std::uint8_t> labels;
  std::vector<std::uint32_t> instances;
  std::vector<float> beliefs;
  std::vector<std::uint8_t> causes;

  explicit OwnedVerdict(const ScanVerdict& verdict)
      : scan(verdict.scan),
        time(verdict.time),
        T_world_sensor(verdict.T_world_sensor),
        instances(verdict.instances.begin(), verdict.instances.end()),
        beliefs(verdict.beliefs.begin(), verdict.beliefs.end()) {
    labels.reserve(verdict.labels.size());
    for (const PointLabel label : verdict.labels) {
      labels.push_back(static_cast<std::uint8_t>(label));
    }
    causes.reserve(verdict.causes.size());
    for (const Cause cause : verdict.causes) causes.push_back(static_cast<std::uint8_t>(cause));
  }
};

/// ScanVerdict with arrays that Python owns.
struct Verdict {
  std::uint64_t scan;
  double time;
  py::array_t<double> T_world_sensor;
  py::array_t<std::uint8_t> labels;
  py::array_t<std::uint32_t> instances;
  py::array_t<float> beliefs;
  py::array_t<std::uint8_t> causes;

  explicit Verdict(OwnedVerdict&& verdict)
      : scan(verdict.scan),
        time(verdict.time),
        T_world_sensor(to_array(verdict.T_world_sensor)),
        labels(to_array(std::move(verdict.labels))),
        instances(to_array(std::move(verdict.instances))),
        beliefs(to_array(std::move(verdict.beliefs))),
        causes(to_array(std::move(verdict.causes))) {}
};

}  // namespace dynains::python
