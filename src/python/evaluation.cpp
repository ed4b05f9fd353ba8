#include <algorithm>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "dynains/evaluation/evaluate.hpp"
#include "settings.hpp"

namespace dynains::python {
namespace {

using evaluation::EvaluationConfig;
using evaluation::LabelledScan;

template <class T>
using Contiguous = py::array_t<T, py::array::c_style | py::array::forcecast>;

// The arrays of one scan, and the view of them that the protocols see.
struct JudgedScan {
  Contiguous<float> points;
  Contiguous<std::uint32_t> truth;
  Contiguous<std::uint8_t> kept;
  LabelledScan view;
};

[[noreturn]] void refuse(const char* what, std::size_t scan, const std::string& expected) {
  throw py::type_error(std::string(what) + " of scan " + std::to_string(scan) + ": expected " +
                       expected);
}

// The object as a NumPy array; null if NumPy cannot convert it.
py::array as_array(const py::handle& values) {
  py::array array = py::array::ensure(py::reinterpret_borrow<py::object>(values));
  if (!array) PyErr_Clear();
  return array;
}

// Integers up to `most`, or flags as 0 and 1. `expected` describes them in the error message.
template <class T>
Contiguous<T> to_numbers(const char* what, std::size_t scan, const py::array& array,
                         std::int64_t most, const std::string& expected) {
  if (!array) refuse(what, scan, expected);
  const bool is_whole = std::string("biu").find(array.dtype().kind()) != std::string::npos;
  if (!is_whole && array.size() > 0) refuse(what, scan, expected);
  const Contiguous<std::int64_t> numbers = array;
  const Span<const std::int64_t> all(numbers.data(), static_cast<std::size_t>(numbers.size()));
  const auto is_wrong = [most](std::int64_t number) { return number < 0 || number > most; };
  if (std::any_of(all.begin(), all.end(), is_wrong)) refuse(what, scan, expected);
  return py::vectorize([](std::int64_t number) { return static_cast<T>(number); })(numbers);
}

// Flags become SemanticKITTI's moving car and road.
Contiguous<std::uint32_t> to_truth(std::size_t scan, const py::array& truth) {
  const auto labels = to_numbers<std::uint32_t>(
      "truth", scan, truth, std::numeric_limits<std::uint32_t>::max(),
      "labels of SemanticKITTI (whole numbers of 32 bits) or bool (True moves)");
  if (truth.dtype().kind() != 'b') return labels;
  constexpr std::uint32_t kMovingCar = 252;
  constexpr std::uint32_t kRoad = 40;
  return py::vectorize([](std::uint32_t moving) { return moving != 0 ? kMovingCar : kRoad; })(
      labels);
}

void expect_length(const char* what, std::size_t scan, const py::array& array, py::ssize_t length) {
  if (array.ndim() == 1 && array.shape(0) == length) return;
  throw std::invalid_argument(std::string(what) + " of scan " + std::to_string(scan) + ": shape " +
                              shape_text(array) + ", expected (" + std::to_string(length) + ",)");
}

JudgedScan make_scan(std::size_t index, const py::handle& points, const py::handle& pose,
                     const py::handle& truth, const py::handle& kept) {
  JudgedScan scan{Contiguous<float>::ensure(points),
                  to_truth(index, as_array(truth)),
                  to_numbers<std::uint8_t>("kept", index, as_array(kept), 1,
                                           "bool, for example is_static(verdict.labels)"),
                  {}};
  if (!scan.points) refuse("points", index, "an array (N, 3) or (N, 4) of numbers");
  expect_rows_of_points("points of scan " + std::to_string(index) + ": shape ", scan.points);
  const py::ssize_t count = scan.points.shape(0);
  expect_length("truth", index, scan.truth, count);
  expect_length("kept", index, scan.kept, count);
  const auto size = static_cast<std::size_t>(count);
  scan.view.xyz = scan.points.data();
  scan.view.stride = static_cast<std::size_t>(scan.points.shape(1));
  scan.view.T_world_sensor = to_pose(pose);
  scan.view.truth = {scan.truth.data(), size};
  scan.view.in_map = {scan.kept.data(), size};
  return scan;
}

py::dict to_dict(const evaluation::EvaluationRow& row) {
  py::dict result;
  result["PR"] = row.voxels.kept();
  result["RR"] = row.voxels.removed();
  result["F1"] = row.voxels.f1();
  result["SA"] = row.points.kept();
  result["DA"] = row.points.removed();
  result["AA"] = row.points.associated();
  result["HA"] = row.points.harmonic();
  if (row.objects) {
    result["kept"] = row.objects->kept();
    result["left"] = row.objects->removed();
  }
  return result;
}

py::dict evaluate_arrays(const py::sequence& points, const py::sequence& poses,
                         const py::sequence& truth, const py::sequence& kept,
                         const std::string& dynamic_classes, const std::string& unlabeled,
                         const py::kwargs& settings) {
  if (poses.size() != points.size() || truth.size() != points.size() ||
      kept.size() != points.size()) {
    throw std::invalid_argument("evaluate: points, poses, truth and kept need as many scans each");
  }
  const auto treatment = value_of_name<evaluation::Unlabeled>(unlabeled);
  if (!treatment) throw ConfigError("unlabeled = '" + unlabeled + "': expected ignore or static");
  EvaluationConfig config;
  assign_all(config, settings);
  config.truth = evaluation::TruthClasses(dynamic_classes, *treatment);
  std::vector<JudgedScan> scans;
  for (std::size_t i = 0; i < points.size(); ++i) {
    scans.push_back(make_scan(i, points[i], poses[i], truth[i], kept[i]));
  }
  const auto source = [&scans](std::size_t index, LabelledScan& scan) {
    if (index >= scans.size()) return false;
    scan = scans[index].view;
    return true;
  };
  evaluation::Evaluation result;
  {
    const py::gil_scoped_release release;
    result = evaluation::evaluate(source, {"estimate"}, {}, config);
  }
  py::dict rows;
  for (const evaluation::EvaluationRow& row : result.rows) rows[row.name.c_str()] = to_dict(row);
  return rows;
}

}  // namespace

void bind_evaluation(py::module_& module) {
  const std::string doc =
      "Judges what was kept of each scan by its ground truth.\n\n"
      "points, poses, truth, kept: sequences with an entry per scan. points: (N, 3 to 64), "
      "metres, sensor frame. poses: (4, 4), T_world_sensor. truth: (N,) labels of SemanticKITTI, "
      "or bool (True moves). kept: (N,) bool, for example is_static(verdict.labels).\n"
      "Returns {'identity': row, 'oracle': row, 'estimate': row}. A row has PR, RR (percent) and "
      "F1 (0 to 1) after ERASOR, SA, DA, AA and HA (percent) after KTH's DynamicMap_Benchmark, "
      "kept and left (percent of the static and moving objects, by instance id; nan without); "
      "NaN is a share of nothing.\n"
      "dynamic_classes: ids and ranges. unlabeled: 'ignore' or 'static' (classes 0 and 1).\n"
      "Settings by name:\n" +
      describe_settings<EvaluationConfig>();
  module.def("evaluate", &evaluate_arrays, py::arg("points"), py::arg("poses"), py::arg("truth"),
             py::arg("kept"),
             py::arg("dynamic_classes") = evaluation::TruthClasses().dynamic_classes(),
             py::arg("unlabeled") = "ignore", doc.c_str());
}

}  // namespace dynains::python
