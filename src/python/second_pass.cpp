#include "dynains/recording/second_pass.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "dynains/errors.hpp"
#include "verdict.hpp"

namespace dynains::python {
namespace {

PointBuffer copied_points(const py::object& points) {
  PointBuffer result;
  with_points(points, [&](const auto& cloud) {
    for (std::size_t i = 0; i < cloud.count; ++i) {
      result.push_back(cloud.coordinate(i, 0), cloud.coordinate(i, 1), cloud.coordinate(i, 2));
    }
  });
  return result;
}

template <class To, class From>
std::vector<To> converted(const py::array_t<From>& array) {
  std::vector<To> result(static_cast<std::size_t>(array.size()));
  std::transform(array.data(), array.data() + array.size(), result.begin(),
                 [](From value) { return static_cast<To>(value); });
  return result;
}

VerdictArrays arrays_of(const Verdict& verdict) {
  VerdictArrays arrays;
  arrays.labels = converted<PointLabel>(verdict.labels);
  arrays.causes = converted<Cause>(verdict.causes);
  arrays.instances = converted<std::uint32_t>(verdict.instances);
  arrays.beliefs = converted<float>(verdict.beliefs);
  return arrays;
}

ScanVerdict over(const VerdictArrays& arrays, const Verdict& verdict) {
  ScanVerdict result;
  result.scan = verdict.scan;
  result.time = verdict.time;
  result.T_world_sensor = to_pose(verdict.T_world_sensor);
  result.labels = arrays.labels;
  result.causes = arrays.causes;
  result.instances = arrays.instances;
  result.beliefs = arrays.beliefs;
  return result;
}

// The second pass without the interpreter's lock: a mutex keeps threads that share it apart.
class SecondPassInMemory {
 public:
  explicit SecondPassInMemory(const SecondPassConfig& config) : pass_(store_, config) {}

  void add(const py::object& points, const Verdict& verdict, const py::object& T_world_compared,
           bool begins_epoch) {
    const ComparedPose compared = {
        to_pose(T_world_compared.is_none() ? py::object(verdict.T_world_sensor) : T_world_compared),
        begins_epoch};
    const PointBuffer buffer = copied_points(points);
    const VerdictArrays arrays = arrays_of(verdict);
    const ScanVerdict first = over(arrays, verdict);
    const py::gil_scoped_release release;
    const std::lock_guard<std::mutex> lock(mutex_);
    pass_.add(buffer, first, compared);
  }
  void test() {
    const py::gil_scoped_release release;
    const std::lock_guard<std::mutex> lock(mutex_);
    pass_.test();
  }
  Verdict revise(const py::object& points, const Verdict& verdict) {
    const PointBuffer buffer = copied_points(points);
    VerdictArrays arrays = arrays_of(verdict);
    {
      const py::gil_scoped_release release;
      const std::lock_guard<std::mutex> lock(mutex_);
      pass_.revise(buffer, static_cast<std::uint32_t>(verdict.scan), arrays);
    }
    return Verdict(OwnedVerdict(over(arrays, verdict)));
  }
  std::uint64_t removed() const { return pass_.removed(); }
  std::uint64_t restored() const { return pass_.restored(); }

 private:
  std::mutex mutex_;
  MemoryStore store_;
  SecondPass pass_;
};

StaticPolicy policy_of(const std::string& name) {
  if (name == "always") return StaticPolicy::kAlways;
  if (name == "last") return StaticPolicy::kLast;
  throw ConfigError("static is '" + name + "', expected 'always' or 'last'");
}

}  // namespace

void bind_second_pass(py::module_& module) {
  py::class_<SecondPassInMemory>(
      module, "SecondPass",
      "Verdicts by all scans of a recording: add() all scans with their first verdicts, test(), "
      "and revise() each. The references wait in memory. Calls release the interpreter's lock.")
      .def(py::init([](const std::string& policy, int threads) {
             SecondPassConfig config;
             config.static_policy = policy_of(policy);
             config.threads = threads;
             return std::make_unique<SecondPassInMemory>(config);
           }),
           py::arg("static") = "always", py::arg("threads") = 1,
           "static: 'always' (nothing that came or went) or 'last' (what stands at last). threads: "
           "1 or 2. Raises ConfigError.")
      .def("add", &SecondPassInMemory::add, py::arg("points"), py::arg("verdict"),
           py::arg("T_world_compared") = py::none(), py::arg("begins_epoch") = false,
           "Takes a scan, (N, 3 to 64) metres, sensor frame, and the final ScanVerdict on it, in "
           "the order of the scans. T_world_compared: (4, 4), the pose with the corrections of "
           "FrameResult.pose_residual; default: as pushed. begins_epoch: whether "
           "FrameResult.began_epoch tells so; no scan before it is compared with it. Raises "
           "UsageError for another order or size.")
      .def("test", &SecondPassInMemory::test, "Tests all places, after the last scan.")
      .def("revise", &SecondPassInMemory::revise, py::arg("points"), py::arg("verdict"),
           "The revised ScanVerdict on a scan.")
      .def_property_readonly("removed", &SecondPassInMemory::removed,
                             "Points that left in revise().")
      .def_property_readonly("restored", &SecondPassInMemory::restored,
                             "Points that came back in revise().")
      .def("__repr__", [](const SecondPassInMemory& pass) {
        return "<dynains.SecondPass: " + std::to_string(pass.removed()) + " points left, " +
               std::to_string(pass.restored()) + " came back>";
      });
}

}  // namespace dynains::python
