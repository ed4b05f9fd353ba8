#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "dynains/median.hpp"
#include "io/points/finite_points.hpp"
#include "pose_fit.hpp"

namespace dynains {
namespace {

using Motions = std::vector<RegisteredMotion>;

/// The order of quaternions that is not in use: other than the given one, or than the order of the
/// format if none is given. kNone without quaternions.
QuaternionOrder other_order(const Recording& recording) {
  if (recording.trajectory().order == QuaternionOrder::kNone) return QuaternionOrder::kNone;
  QuaternionOrder order = recording.options().convention.quaternion;
  if (order == QuaternionOrder::kNone) order = recording.trajectory().order;
  return order == QuaternionOrder::kXyzw ? QuaternionOrder::kWxyz : QuaternionOrder::kXyzw;
}

Reading given_reading(const Recording& recording) {
  return {recording.options().convention, recording.options().time_offset, 0};
}

/// Factor of the ways under which most motions agree; empty without motion.
std::optional<Reading> fit_scale(const Recording& recording, const Motions& motions) {
  constexpr double kMinWay = 0.2;     // m
  constexpr double kMaxFactor = 3.0;  // more is another unit, or no motion
  const BodyMotion given = given_motion(recording);
  std::vector<double> factors;
  for (const RegisteredMotion& motion : motions) {
    const auto T = given(motion.first, motion.second);
    if (!T || !(T->translation().norm() > kMinWay)) continue;
    const Eigen::Vector3d way = T->translation();
    factors.push_back(way.dot(motion.T_first_second.translation()) / way.squaredNorm());
  }
  // Three digits: more are not known.
  const double factor = std::round(1e3 * median(std::move(factors))) / 1e3;
  if (!(1.0 / kMaxFactor < factor && factor < kMaxFactor)) return std::nullopt;
  Reading result = given_reading(recording);
  result.complexity = 2;
  result.convention.scale =
      std::clamp(result.convention.scale * factor, kMinPoseScale, kMaxPoseScale);
  return result;
}

/// The offset of the clocks with the least error; empty without times, or if it is 0 or at an end
/// of the range.
std::optional<Reading> fit_offset(const Recording& recording, const Motions& motions) {
  constexpr double kMaxOffset = 0.6;  // s
  constexpr double kStep = 0.005;     // s
  Reading result = given_reading(recording);
  double best = 0.0;
  double least = error_at_points(motions, motion_under(recording, result));
  const auto steps = static_cast<int>(kMaxOffset / kStep);
  for (int k = -steps; k <= steps; ++k) {
    result.time_offset = recording.options().time_offset + kStep * k;
    const MotionError error = motion_error(motions, motion_under(recording, result));
    if (2 * error.pairs < motions.size() || !(error.at_points < least)) continue;
    least = error.at_points;
    best = kStep * k;
  }
  if (best == 0.0 || !(std::abs(best) < kMaxOffset - 4.0 * kStep)) return std::nullopt;
  return Reading{recording.options().convention, recording.options().time_offset + best, 1};
}

/// Without parts that explain nothing: a rotation or translation near 0, or one that the motions do
/// not determine.
Pose simplified(const Motions& motions, const BodyMotion& body, const Pose& T_body_sensor) {
  const double error = motion_error(motions, body, T_body_sensor).at_points;
  const auto is_enough = [&](const Pose& simpler) {
    return motion_error(motions, body, simpler).at_points < 1.1 * error + 0.002;
  };
  Pose unturned = T_body_sensor;
  unturned.linear().setIdentity();
  Pose result = is_enough(unturned) ? unturned : T_body_sensor;
  Pose unmoved = result;
  unmoved.translation().setZero();
  if (is_enough(unmoved)) return unmoved;
  Pose level = result;
  level.translation().z() = 0.0;
  return is_enough(level) ? level : result;
}

/// A body whose poses have the meaning `base`, and in which the sensor lies somewhere.
std::optional<Reading> fit_body(const Recording& recording, const Motions& motions,
                                const Reading& base) {
  const BodyMotion body = motion_under(recording, base);
  const auto fitted = fit_extrinsic(motions, body);
  if (!fitted) return std::nullopt;
  Reading result = base;
  result.complexity += 3;
  // The convention gives the pose of the frame of the clouds, in which the sensor has a position.
  const Eigen::Translation3d origin(recording.sensor_origin());
  result.convention.T_body_sensor = base.convention.T_body_sensor * origin *
                                    simplified(motions, body, *fitted) * origin.inverse();
  return result;
}

/// The coordinate of a scan in the files for which half of the points are smaller, by axis.
Eigen::Vector3d middle_in_file(const Recording& recording, std::size_t i) {
  const PointBuffer points = finite_points(recording.read_scan(i));
  const bool is_world = recording.frame() == PointFrame::kWorld;
  const Pose T_file_sensor = is_world ? recording.T_world_sensor(i) : Pose::Identity();
  std::vector<double> x, y, z;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Eigen::Vector3d p =
        T_file_sensor * Eigen::Vector3f(points.x[k], points.y[k], points.z[k]).cast<double>();
    x.push_back(p.x());
    y.push_back(p.y());
    z.push_back(p.z());
  }
  return {median(std::move(x)), median(std::move(y)), median(std::move(z))};
}

}  // namespace

BodyMotion motion_under(const Recording& recording, const Reading& reading) {
  const double offset = reading.time_offset - recording.options().time_offset;
  return [&recording, convention = reading.convention, offset](
             std::size_t first, std::size_t second) -> std::optional<Pose> {
    const auto pose_of = [&](std::size_t i) {
      return offset == 0.0 ? recording.pose_under(convention, i) : recording.pose_after(i, offset);
    };
    const auto T_world_a = pose_of(first), T_world_b = pose_of(second);
    if (!T_world_a || !T_world_b) return std::nullopt;
    return T_world_a->inverse() * *T_world_b;
  };
}

bool is_much_smaller(double error, double other) {
  return error < 0.5 * other && other - error > 0.02;
}

std::vector<Reading> usual_readings(const Recording& recording) {
  const PoseConvention& given = recording.options().convention;
  std::vector<Reading> all = {given_reading(recording)};
  using Change = std::function<void(PoseConvention&)>;
  const auto combine = [&](const std::vector<Change>& alternatives) {
    const std::size_t count = all.size();
    for (const Change& change : alternatives) {
      for (std::size_t i = 0; i < count; ++i) {
        all.push_back(all[i]);
        change(all.back().convention);
        ++all.back().complexity;
      }
    }
  };
  combine({[](PoseConvention& c) { c.invert = !c.invert; }});
  const QuaternionOrder order = other_order(recording);
  if (order != QuaternionOrder::kNone) {
    combine({[order](PoseConvention& c) { c.quaternion = order; }});
  }
  combine({[](PoseConvention& c) { c.left_handed = !c.left_handed; }});
  const bool is_camera = given.frame == PoseFrame::kCamera ||
                         (given.frame == PoseFrame::kAuto && recording.has_calibration() &&
                          recording.trajectory().order == QuaternionOrder::kNone);
  combine({[is_camera](PoseConvention& c) {
    c.frame = is_camera ? PoseFrame::kLidar : PoseFrame::kCamera;
  }});
  std::vector<Change> units;
  for (const double unit : {0.001, 0.01, 1.0}) {
    if (unit != given.unit) units.emplace_back([unit](PoseConvention& c) { c.unit = unit; });
  }
  combine(units);
  for (const int shift : {1, -1, 2, -2}) {
    all.push_back({given, recording.options().time_offset, 1});
    all.back().convention.shift += shift;
  }
  all.erase(all.begin());  // the given one
  std::stable_sort(all.begin(), all.end(),
                   [](const Reading& a, const Reading& b) { return a.complexity < b.complexity; });
  return all;
}

std::vector<Reading> fitted_readings(const Recording& recording, const Motions& motions) {
  using Fit = std::function<std::optional<Reading>(const Motions&)>;
  std::vector<Fit> fits = {[&](const Motions& of) { return fit_scale(recording, of); },
                           [&](const Motions& of) { return fit_offset(recording, of); }};
  const Reading given = given_reading(recording);
  std::vector<Reading> bases = {given, given};
  bases.back().convention.invert = !given.convention.invert;
  bases.back().complexity = 1;
  const QuaternionOrder order = other_order(recording);
  if (order != QuaternionOrder::kNone) {
    bases.push_back(given);
    bases.back().convention.quaternion = order;
    bases.back().complexity = 1;
  }
  for (const Reading& base : bases) {
    fits.emplace_back([&, base](const Motions& of) { return fit_body(recording, of, base); });
  }
  Motions some, others;
  for (const RegisteredMotion& motion : motions) {
    (motion.chain % 2 == 0 ? some : others).push_back(motion);
  }
  const double before = error_at_points(others, given_motion(recording));
  std::vector<Reading> readings;
  for (const Fit& fit : fits) {
    const auto of_half = fit(some);
    if (!of_half) continue;
    const double then = error_at_points(others, motion_under(recording, *of_half));
    if (!is_much_smaller(then, before)) continue;
    if (const auto reading = fit(motions)) readings.push_back(*reading);
  }
  return readings;
}

std::optional<bool> follow_sensor(const Recording& recording, double min_way) {
  std::size_t farthest = 0;
  const auto way_to = [&](std::size_t i) -> Eigen::Vector3d {
    return recording.T_world_sensor(i).translation() - recording.T_world_sensor(0).translation();
  };
  for (std::size_t i = 0; i < recording.size(); ++i) {
    if (way_to(i).norm() > way_to(farthest).norm()) farthest = i;
  }
  const Eigen::Vector3d way = way_to(farthest);
  if (!(way.norm() > min_way)) return std::nullopt;
  const Eigen::Vector3d moved = middle_in_file(recording, farthest) - middle_in_file(recording, 0);
  return moved.dot(way) > 0.5 * way.squaredNorm();
}

std::vector<RecordingOptions> other_options(const Recording& recording,
                                            const std::optional<Eigen::Vector3d>& ray_origin) {
  std::vector<RecordingOptions> all;
  const auto add = [&](auto&& change) {
    all.push_back(recording.options());
    change(all.back());
  };
  const bool is_world = recording.frame() == PointFrame::kWorld;
  if (ray_origin) {
    constexpr double kSame = 0.1;  // m
    add([&](RecordingOptions& o) {
      o.sensor_origin = *ray_origin;
      if (ray_origin->norm() < kSame) o.sensor_origin.setZero();
      o.sensor_frame.clear();
    });
  }
  if (recording.columns().time && !is_world) add([](RecordingOptions& o) { o.deskew = !o.deskew; });
  // A short way is weak evidence, but a proposal must also agree.
  constexpr double kMinWay = 1.0;  // m
  if (recording.size() > 0 && follow_sensor(recording, kMinWay) == !is_world) {
    add([&](RecordingOptions& o) {
      o.frame = is_world ? PointFrame::kSensor : PointFrame::kWorld;
      o.deskew = false;
    });
  }
  return all;
}

}  // namespace dynains
