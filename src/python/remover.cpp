#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iomanip>
#include <mutex>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "dynains/compiled_remover.hpp"
#include "dynains/errors.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"
#include "settings.hpp"

namespace dynains::python {
namespace {

/// A copy of a span.
template <class To, class From>
py::array_t<To> to_array_of(Span<const From> values) {
  std::vector<To> copy;
  copy.reserve(values.size());
  for (const From value : values) copy.push_back(static_cast<To>(value));
  return to_array(std::move(copy));
}

/// A structured array of float64, with a field for each number of an object.
py::object objects_of(Span<const MovingObject> objects) {
  std::vector<double> numbers;
  for (const MovingObject& object : objects) {
    MovingObject::visit(
        object, [&](const char*, auto number) { numbers.push_back(static_cast<double>(number)); });
  }
  py::list fields;
  const MovingObject none;
  MovingObject::visit(none,
                      [&](const char* name, auto) { fields.append(py::make_tuple(name, "f8")); });
  return to_array(std::move(numbers), fields.size()).attr("view")(fields).attr("reshape")(-1);
}

/// ScanVerdict with arrays that Python owns.
struct Verdict {
  std::uint64_t scan;
  double time;
  py::array_t<double> T_world_sensor, T_world_compared;
  std::uint64_t epoch;
  py::array_t<std::uint8_t> labels;
  py::array_t<std::uint32_t> instances;
  py::array_t<float> beliefs;
  py::array_t<std::uint8_t> causes;
  py::object objects;

  explicit Verdict(const ScanVerdict& verdict)
      : scan(verdict.scan),
        time(verdict.time),
        T_world_sensor(to_array(verdict.T_world_sensor)),
        T_world_compared(to_array(verdict.compared.T_world_sensor)),
        epoch(verdict.compared.epoch),
        labels(to_array_of<std::uint8_t>(verdict.labels)),
        instances(to_array_of<std::uint32_t>(verdict.instances)),
        beliefs(to_array_of<float>(verdict.beliefs)),
        causes(to_array_of<std::uint8_t>(verdict.causes)),
        objects(objects_of(verdict.objects)) {}
};

struct Frame {
  py::object newest;
  py::object finished;
  py::dict times;
  std::optional<PoseResidual> pose_residual;
  std::optional<std::string> time_doubt, began_epoch;
  py::dict plausibility;
};

py::dict to_dict(const Plausibility& window) {
  py::dict shares;
  shares["not_judged"] = window.not_judged;
  shares["ground_free"] = window.ground_free;
  shares["instance_free"] = window.instance_free;
  shares["misfits"] = window.misfits;
  shares["residual"] = window.residual;
  shares["suspicion"] = py::none();
  if (window.suspicion != Suspicion::kNone) shares["suspicion"] = plain_value(window.suspicion);
  shares["since"] = window.since;
  return shares;
}

using SensorNumbers = py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast>;

// Runs of points of one sensor.
std::vector<SensorRange> ranges_of(const SensorNumbers& sensors, const py::object& points) {
  const auto count = static_cast<std::size_t>(sensors.size());
  if (sensors.ndim() != 1 || count != py::len(points)) {
    throw CloudError("sensors have " + std::to_string(count) + " numbers for " +
                     std::to_string(py::len(points)) + " points");
  }
  std::vector<SensorRange> ranges;
  const std::uint8_t* const numbers = sensors.data();
  for (std::size_t i = 0; i < count; ++i) {
    if (ranges.empty() || ranges.back().sensor != numbers[i]) ranges.push_back({i, 0, numbers[i]});
    ++ranges.back().length;
  }
  return ranges;
}

// The remover without the interpreter's lock: a mutex keeps threads that share it apart.
class Remover {
 public:
  explicit Remover(const DynaInsRemover::Config& config) : remover_(config) {}

  Frame push(const py::object& points, const py::object& pose, std::optional<double> time,
             const std::optional<SensorNumbers>& sensors) {
    const Pose T_world_sensor = to_pose(pose);
    const std::vector<SensorRange> ranges =
        sensors ? ranges_of(*sensors, points) : std::vector<SensorRange>();
    Frame frame;
    with_points(points, [&](const auto& cloud) {
      const py::gil_scoped_release release;
      const std::lock_guard<std::mutex> lock(mutex_);
      const FrameResult result = remover_.push(cloud, T_world_sensor, time, ranges);
      const ScanVerdict newest = result.newest();
      // Whoever holds the interpreter's lock releases it to wait for the mutex.
      const py::gil_scoped_acquire acquire;
      frame.newest = py::cast(Verdict(newest));
      frame.finished = result.finished ? py::cast(Verdict(*result.finished)) : py::none();
      StageTimes::visit(result.times,
                        [&](const char* stage, double ms) { frame.times[stage] = ms; });
      frame.pose_residual = result.pose_residual;
      if (result.time_doubt == TimeDoubt::kTooSlow) frame.time_doubt = "too slow";
      if (result.time_doubt == TimeDoubt::kTooFast) frame.time_doubt = "too fast";
      if (result.began_epoch) frame.began_epoch = plain_value(*result.began_epoch);
      frame.plausibility = to_dict(result.plausibility);
    });
    return frame;
  }

  py::list flush() {
    py::list result;
    without_interpreter([&] {
      remover_.flush([&](const ScanVerdict& verdict) {
        const py::gil_scoped_acquire acquire;
        result.append(Verdict(verdict));
      });
    });
    return result;
  }

  py::array_t<double> map_points() {
    std::vector<double> xyz;
    without_interpreter([&] {
      xyz.reserve(3 * remover_.map().size());
      remover_.map().for_each([&](const Eigen::Vector3d& p) {
        xyz.insert(xyz.end(), {p.x(), p.y(), p.z()});
      });
    });
    return to_array(std::move(xyz), 3);
  }

  std::size_t map_size() {
    std::size_t size = 0;
    without_interpreter([&] { size = remover_.map().size(); });
    return size;
  }

  void reset() {
    without_interpreter([&] { remover_.reset(); });
  }

  // Neither changes after construction.
  const DynaInsRemover::Config& config() const { return remover_.config(); }
  std::size_t latency() const { return remover_.latency(); }

 private:
  template <class Work>
  void without_interpreter(Work&& work) {
    const py::gil_scoped_release release;
    const std::lock_guard<std::mutex> lock(mutex_);
    work();
  }

  std::mutex mutex_;
  DynaInsRemover remover_;
};

std::string represent(const Verdict& verdict) {
  const auto dynamic = static_cast<std::uint8_t>(PointLabel::kDynamic);
  const std::uint8_t* const labels = verdict.labels.data();
  std::ostringstream text;
  text << "<dynains.ScanVerdict: scan " << verdict.scan << " at " << verdict.time << " s, "
       << verdict.labels.size() << " points, "
       << std::count(labels, labels + verdict.labels.size(), dynamic) << " dynamic>";
  return text.str();
}

std::string represent(const PoseResidual& residual) {
  std::ostringstream text;
  text << std::setprecision(3) << "<dynains.PoseResidual: " << residual.translation << " m, "
       << residual.rotation << " deg>";
  return text.str();
}

std::string represent(const Frame& frame) {
  const auto verdict = [](const py::object& value) {
    return value.is_none() ? "None" : represent(value.cast<const Verdict&>());
  };
  return "<dynains.FrameResult: newest " + verdict(frame.newest) + ", finished " +
         verdict(frame.finished) + '>';
}

std::string represent(Remover& remover) {
  const std::string config = py::repr(py::cast(remover.config()));
  return "<dynains.DynaInsRemover: " + std::to_string(remover.map_size()) + " points on the map, " +
         config + '>';
}

void bind_label(py::module_& module) {
  const auto value = [](PointLabel label) { return static_cast<int>(label); };
  py::dict names;
  names["INVALID"] = value(PointLabel::kInvalid);
  names["OUT_OF_RANGE"] = value(PointLabel::kOutOfRange);
  names["GROUND"] = value(PointLabel::kGround);
  names["STATIC"] = value(PointLabel::kStatic);
  names["DYNAMIC"] = value(PointLabel::kDynamic);
  py::object label_enum = py::module_::import("enum").attr("IntEnum")(
      "Label", names, py::arg("module") = module.attr("__name__"));
  label_enum.attr("__doc__") =
      "Verdict on a point: INVALID (NaN, infinite, no return), OUT_OF_RANGE, GROUND, STATIC, "
      "DYNAMIC (part of a moving instance).";
  module.attr("Label") = label_enum;

  module.def(
      "is_static",
      [](const py::array_t<std::uint8_t>& labels) {
        return py::array_t<bool>(py::vectorize(
            [](std::uint8_t label) { return is_static(static_cast<PointLabel>(label)); })(labels));
      },
      py::arg("labels"), "True where a label is GROUND or STATIC: what belongs on a map.");
}

}  // namespace

void bind_remover(py::module_& module) {
  bind_label(module);

  py::class_<Verdict>(module, "ScanVerdict",
                      "Verdict on every point of one scan, in the order of the input.")
      .def_readonly("scan", &Verdict::scan, "Number of the push, from 0.")
      .def_readonly("time", &Verdict::time, "s, as pushed.")
      .def_readonly("T_world_sensor", &Verdict::T_world_sensor, "(4, 4) float64, as pushed.")
      .def_readonly("T_world_compared", &Verdict::T_world_compared,
                    "(4, 4) float64, by which the scan is compared: as pushed, or corrected.")
      .def_readonly("epoch", &Verdict::epoch, "Only scans of one epoch are compared.")
      .def_readonly("labels", &Verdict::labels, "(N,) uint8, see Label.")
      .def_readonly("instances", &Verdict::instances, "(N,) uint32; 0 belongs to no instance.")
      .def_readonly("beliefs", &Verdict::beliefs,
                    "(N,) float32, probability of being dynamic; 0 if never proposed.")
      .def_readonly("causes", &Verdict::causes,
                    "(N,) uint8, why the label is what it is; the numbers are those of "
                    "dynains/verdict.hpp.")
      .def_readonly("objects", &Verdict::objects,
                    "(M,) structured float64: moving objects by id, with Config.objects. Fields: "
                    "id, x, y, z (m, world), length, width, height (m), yaw (rad), vx, vy (m/s), "
                    "points, first_scan, last_scan.")
      .def("__repr__", [](const Verdict& verdict) { return represent(verdict); });

  py::class_<PoseResidual>(module, "PoseResidual",
                           "Error of the pushed motion of the sensor, by an alignment of the "
                           "scan with earlier scans.")
      .def_readonly("translation", &PoseResidual::translation, "m")
      .def_readonly("rotation", &PoseResidual::rotation, "deg")
      .def_property_readonly(
          "T_previous_newest",
          [](const PoseResidual& residual) { return to_array(residual.T_previous_newest); },
          "(4, 4) float64: corrected pose of this scan in the sensor frame of the previous one.")
      .def_property_readonly(
          "T_previous_aligned",
          [](const PoseResidual& residual) { return to_array(residual.T_previous_aligned); },
          "(4, 4) float64: the motion that fits best, whether or not it is certain.")
      .def_property_readonly(
          "covariance",
          [](const PoseResidual& residual) {
            return py::array_t<double>({6, 6}, residual.covariance.data());
          },
          "(6, 6) float64, of an error e of T_previous_aligned: translation (m) and rotation (rad) "
          "along the axes of the newest sensor frame; exact motion = aligned motion * Exp(e).")
      .def_property_readonly(
          "supported",
          [](const PoseResidual& residual) {
            std::array<bool, 6> supported{};
            for (std::size_t i = 0; i < 6; ++i) supported[i] = residual.is_supported(i);
            return supported;
          },
          "Six bools, as the axes of `covariance`: whether the surfaces determine the error to 10 "
          "cm.")
      .def_readonly("previous_scan", &PoseResidual::previous_scan,
                    "Number of the previous scan, the last one that was taken, from 0.")
      .def_readonly("previous_time", &PoseResidual::previous_time, "s, of that scan")
      .def("__repr__", [](const PoseResidual& residual) { return represent(residual); });

  py::class_<Frame>(module, "FrameResult", "Answer to one scan.")
      .def_readonly("newest", &Frame::newest,
                    "ScanVerdict: what the past alone says of the scan just pushed.")
      .def_readonly("finished", &Frame::finished,
                    "ScanVerdict of the scan whose verdict is now final, or None.")
      .def_readonly("times", &Frame::times, "Milliseconds by stage.")
      .def_readonly("pose_residual", &Frame::pose_residual,
                    "PoseResidual: error of the pushed pose relative to earlier scans; None if it "
                    "is unknown.")
      .def_readonly(
          "began_epoch", &Frame::began_epoch,
          "Why the scan is not compared with earlier ones: \"start\", \"sensor\", \"pause\", "
          "\"jump\" or \"misfit\". Else None.")
      .def_property_readonly(
          "suspicion",
          [](const Frame& frame) { return py::object(frame.plausibility["suspicion"]); },
          "What the last scans contradict: \"units\", \"poses\" or \"rays\" (origin of rays, "
          "times of points). Else None.")
      .def_readonly(
          "plausibility", &Frame::plausibility,
          "Shares over the last ten scans, 0 to 1: not_judged (points invalid, too near or too "
          "far), ground_free (beams through the ground, of those that reach or pass it), "
          "instance_free (samples above the ground seen free, of those seen free or hit), misfits "
          "(scans that begin an epoch because poses or surfaces do not fit); residual (m, mean "
          "translation of PoseResidual, each at most 0.15); suspicion; since (number of the scan "
          "at which the suspicious window began).")
      .def_readonly(
          "time_doubt", &Frame::time_doubt,
          "\"too slow\": the last four scans are more than max_gap apart, so no scan is compared; "
          "\"too fast\": less than 1 ms. The unit of time may be wrong. Else None.")
      .def("__repr__", [](const Frame& frame) { return represent(frame); });

  py::class_<Remover>(module, "DynaInsRemover",
                      "Removes moving instances from a stream of scans, one scan at a time. "
                      "Calls release the interpreter's lock.")
      .def(py::init<const DynaInsRemover::Config&>(), py::arg("config"),
           "Raises ConfigError if parameters contradict.")
      .def(py::init([](const py::kwargs& values) {
             DynaInsRemover::Config config;
             assign_all(config, values);
             return std::make_unique<Remover>(config);
           }),
           "Defaults, with the parameters that are named set.")
      .def(
          "push", &Remover::push, py::arg("points"), py::arg("T_world_sensor"),
          py::arg("time") = py::none(), py::arg("sensors") = py::none(),
          "Takes one scan in and returns a FrameResult.\n\n"
          "points: (N, 3 to 64) float32 or float64, metres, sensor frame; any strides, never "
          "copied as a whole. T_world_sensor: (4, 4). time: s, increasing; without it scans are "
          "0.1 s apart. sensors: (N,) uint8, index in Config.sensors; without it all points are of "
          "the first. Raises CloudError, PoseError or TypeError, and then nothing has changed.")
      .def("flush", &Remover::flush,
           "Final verdicts on all scans still open, oldest first, as a list of ScanVerdict. The "
           "next push starts a new window.")
      .def("reset", &Remover::reset, "Back to the state after construction.")
      .def("map_points", &Remover::map_points, "Static map as (N, 3) float64, metres, world frame.")
      .def_property_readonly("map_size", &Remover::map_size, "Points on the static map.")
      .def_property_readonly("latency", &Remover::latency,
                             "Scans between a push and the final verdict on it.")
      .def_property_readonly("config", &Remover::config, "A copy of the Config.",
                             py::return_value_policy::copy)
      .def("__repr__", [](Remover& remover) { return represent(remover); });
}

}  // namespace dynains::python
