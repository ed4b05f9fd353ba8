#include "cloud_remarks.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <vector>

#include "dynains/evaluation/text_table.hpp"
#include "io/points/finite_points.hpp"

namespace dynains::program {
namespace {

constexpr double kDegrees = 180.0 / 3.14159265358979323846;

/// Whether nearly all coordinates of an axis in the frame `file` lie multiples of `step` (m) apart.
bool are_multiples(const RecordedScan& scan, const Pose& T_file_sensor, Eigen::Index axis,
                   double step) {
  constexpr std::size_t kFewest = 100;
  constexpr double kNear = 0.1;  // of a step
  std::size_t count = 0, on_grid = 0;
  double first = 0.0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const Eigen::Vector3d p = scan.point(i).position;
    if (!p.allFinite() || p.isZero(0.0)) continue;
    const double place = (T_file_sensor * p)[axis];
    if (count == 0) first = place;
    const double steps = (place - first) / step;
    on_grid += std::abs(steps - std::round(steps)) < kNear ? 1 : 0;
    ++count;
  }
  return count >= kFewest && on_grid * 20 >= count * 19;
}

/// Upward normals (sensor frame) under which scan i has ground below the sensor, for a sensor that
/// lies on one of its sides.
std::vector<Eigen::Vector3d> sideways_normals(const RecordedScan& scan) {
  std::vector<Eigen::Vector3d> normals;
  const auto z = Eigen::Vector3d::UnitZ();
  for (const Eigen::Vector3d& up : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-1, 0, 0),
                                    Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, -1, 0)}) {
    Eigen::Matrix3d R;  // from the sensor to a frame whose z axis is `up`
    R.row(0) = z;
    R.row(1) = up.cross(Eigen::Vector3d(z));
    R.row(2) = up;
    PointBuffer turned;
    for (std::size_t i = 0; i < scan.size(); ++i) {
      const Eigen::Vector3d p = R * scan.point(i).position;
      if (!p.allFinite() || p.isZero(0.0)) continue;
      turned.push_back(static_cast<float>(p.x()), static_cast<float>(p.y()),
                       static_cast<float>(p.z()));
    }
    const Mounting mounting = estimate_mounting(turned);
    const bool is_upright = mounting.known && mounting.up_sensor.z() > 0.0;
    if (is_upright) normals.emplace_back(R.transpose() * mounting.up_sensor);
  }
  return normals;
}

/// The normal of all scans of a sample that lies nearest to the z axis of the world; empty if they
/// have none in common.
std::optional<Eigen::Vector3d> common_normal(const Recording& recording) {
  constexpr double kNear = 0.99;  // cosine
  const std::size_t last = recording.size() - 1;
  std::vector<Eigen::Vector3d> common;
  for (const std::size_t i : {std::size_t{0}, last / 2, last}) {
    const std::vector<Eigen::Vector3d> found = sideways_normals(recording.read_scan(i));
    if (i == 0) common = found;
    const auto is_missing = [&](const Eigen::Vector3d& normal) {
      return std::none_of(found.begin(), found.end(),
                          [&](const Eigen::Vector3d& n) { return n.dot(normal) > kNear; });
    };
    common.erase(std::remove_if(common.begin(), common.end(), is_missing), common.end());
  }
  if (common.empty()) return std::nullopt;
  const Eigen::Vector3d z_sensor = recording.T_world_sensor(0).linear().row(2);
  return *std::max_element(common.begin(), common.end(),
                           [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
                             return a.dot(z_sensor) < b.dot(z_sensor);
                           });
}

/// The mounting of a sensor that lies on one of its sides; empty if scans do not show it.
std::optional<std::string> remark_on_tilt(const Recording& recording) {
  const auto up = common_normal(recording);
  if (!up) return std::nullopt;
  const auto degrees = [](double radians) {
    return std::to_string(std::lround(kDegrees * radians));
  };
  return "the sensor seems to be tilted by " + degrees(std::acos(std::clamp(up->z(), -1.0, 1.0))) +
         " deg: pass --mounting-pitch " + degrees(std::asin(std::clamp(-up->x(), -1.0, 1.0))) +
         " --mounting-roll " + degrees(std::atan2(up->y(), up->z()));
}

/// A remark if the points of a scan lie on a grid of 5 cm or more.
std::optional<std::string> remark_on_grid(const RecordedScan& scan, const Pose& T_file_sensor) {
  for (const double step : {1.0, 0.5, 0.4, 0.3, 0.25, 0.2, 0.15, 0.1, 0.05}) {
    if (!are_multiples(scan, T_file_sensor, 0, step) ||
        !are_multiples(scan, T_file_sensor, 1, step)) {
      continue;
    }
    return "points lie on a grid of " + evaluation::format_number(step, 2) +
           " m, as after a voxel filter or a coarse conversion: record the clouds before it";
  }
  return std::nullopt;
}

/// Whether cloud `i` and the next one have points, all of them with equal bits.
bool is_repeated(const Recording& recording, std::size_t i) {
  if (recording.point_count(i) == 0 || recording.point_count(i) != recording.point_count(i + 1)) {
    return false;
  }
  const RecordedScan a = recording.read_scan(i), b = recording.read_scan(i + 1);
  return std::memcmp(a.xyzi.data(), b.xyzi.data(), a.xyzi.size() * sizeof(float)) == 0;
}

}  // namespace

std::optional<std::string> remark_on_stripes(const Recording& recording) {
  constexpr double kLeast = 0.01;  // m
  if (recording.size() == 0) return std::nullopt;
  const RecordedScan scan = recording.read_scan(0);
  if (recording.frame() != PointFrame::kWorld) return remark_on_grid(scan, Pose::Identity());
  const Pose& T_world_sensor = recording.T_world_sensor(0);
  double widest = 0.0;
  double far = 0.0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double place = std::abs(T_world_sensor.translation()[axis]);
    if (!(place > 1.0)) continue;
    const double step = std::exp2(std::floor(std::log2(place)) - 23.0);  // of a float32
    if (step < kLeast || !are_multiples(scan, T_world_sensor, axis, step)) continue;
    widest = std::max(widest, step);
    far = std::max(far, place);
  }
  if (widest == 0.0) return remark_on_grid(scan, T_world_sensor);
  return "points were stored as float32 " + evaluation::format_number(far, 0) +
         " m from the origin of the world, and lie in stripes of " +
         evaluation::format_number(widest, 2) +
         " m: store float64, or subtract an offset from points and poses before they are stored";
}

std::optional<std::string> remark_on_copies(const Recording& recording, const ScanRange& range) {
  constexpr std::size_t kPlaces = 3;
  constexpr double kLeastMotion = 0.05;  // m
  for (std::size_t k = 0; k < kPlaces && range.size() > 2; ++k) {
    const std::size_t first = range.first + k * (range.size() - 3) / (kPlaces - 1);
    for (std::size_t i = first; i < first + 2; ++i) {
      const Pose T = recording.T_world_sensor(i).inverse() * recording.T_world_sensor(i + 1);
      if (T.translation().norm() > kLeastMotion && is_repeated(recording, i)) {
        return "clouds " + recording.name(i) + " and " + recording.name(i + 1) +
               " are equal, though the sensor moves between them: leave copies of clouds out";
      }
    }
  }
  return std::nullopt;
}

std::optional<std::string> remark_on_mounting(const Recording& recording,
                                              const Mounting& mounting) {
  if (mounting.known || recording.size() == 0) return std::nullopt;
  const auto tilt = remark_on_tilt(recording);
  if (tilt) return tilt;
  return "no ground in sight below the sensor, so that height and tilt are not known; if it is "
         "tilted by more than 45 deg: --mounting-pitch, --mounting-roll";
}

std::optional<std::string> remark_on_tilted_scans(const Recording& recording,
                                                  const ScanRange& range) {
  for (const std::size_t i : {range.first, range.first + range.size() / 2, range.last}) {
    if (estimate_mounting(finite_points(recording.read_scan(i))).known) return std::nullopt;
  }
  return remark_on_tilt(recording);
}

}  // namespace dynains::program
