#include "dynains/poses/ray_origin.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "dynains/median.hpp"
#include "dynains/poses/diagnosis.hpp"
#include "dynains/registration/normal_equations.hpp"
#include "dynains/surfaces/surface_grid.hpp"
#include "dynains/threads/in_two_threads.hpp"
#include "io/points/finite_points.hpp"

namespace dynains {
namespace {

constexpr double kRadians = M_PI / 180.0;
constexpr double kSharp = 0.02 * kRadians;  // rad, spread of the elevations of one beam

using Points = std::vector<Eigen::Vector3d>;
using RayEquations = detail::NormalEquations<5>;

/// Beams that turn about an axis through their origin.
struct Rays {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // m
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();

  Eigen::Vector3d side() const { return Eigen::Vector3d::UnitY().cross(axis).normalized(); }
  Eigen::Vector3d front() const { return axis.cross(side()); }
  double elevation(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d q = p - origin;
    return std::asin(std::clamp(axis.dot(q) / q.norm(), -1.0, 1.0));
  }
  /// Derivative of the elevation with respect to the origin and the turns of the axis.
  RayEquations::Vector derivative(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d q = p - origin;
    const double range = q.norm();
    const Eigen::Vector3d ray = q / range;
    const double sine = axis.dot(ray);
    const double cosine = std::sqrt(std::max(1e-6, 1.0 - sine * sine));
    const Eigen::Vector3d by_origin = (sine * ray - axis) / (range * cosine);
    return {by_origin[0], by_origin[1], by_origin[2], side().dot(ray) / cosine,
            front().dot(ray) / cosine};
  }
};

struct Neighbours {
  Eigen::Vector3d first, second;  // m
};

/// For about 4,000 of `points`, the nearest point within the next step of azimuth. Both are of the
/// same beam, also under a wrong origin, unless rings lie closer than the points on a ring.
std::vector<Neighbours> neighbours(const Points& points, const Rays& rays) {
  constexpr std::size_t kCount = 4000;
  constexpr double kNear = 1.2 * kRadians;  // of azimuth, more than the step of any sensor
  constexpr double kSteep = 0.5;            // ratio of the changes of elevation and azimuth
  struct Seen {
    double azimuth, elevation;
    std::size_t point;
  };
  std::vector<Seen> seen;
  const Eigen::Vector3d side = rays.side(), front = rays.front();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d q = points[i] - rays.origin;
    if (!(q.norm() > 0.5 * kMinPoint)) continue;
    seen.push_back({std::atan2(front.dot(q), side.dot(q)), rays.elevation(points[i]), i});
  }
  std::sort(seen.begin(), seen.end(), [](const Seen& a, const Seen& b) {
    return std::pair(a.azimuth, a.point) < std::pair(b.azimuth, b.point);
  });
  std::vector<Neighbours> result;
  for (std::size_t i = 0; i < seen.size(); i += 1 + seen.size() / kCount) {
    const Seen* next = nullptr;
    double nearest = 0.0;
    for (std::size_t k = i + 1; k < seen.size(); ++k) {
      const double along = seen[k].azimuth - seen[i].azimuth;
      if (along > kNear) break;
      const double distance = (points[seen[k].point] - points[seen[i].point]).squaredNorm();
      if (next != nullptr && distance >= nearest) continue;
      next = &seen[k];
      nearest = distance;
    }
    if (next == nullptr) continue;
    const double across = std::abs(next->elevation - seen[i].elevation);
    if (across < kSteep * (next->azimuth - seen[i].azimuth))
      result.push_back({points[seen[i].point], points[next->point]});
  }
  return result;
}

double weight_of(double change, double scale) {
  return 1.0 / (1.0 + change * change / (scale * scale));
}

/// Ratio of the neighbours that are of one beam if beams begin as `rays` says, [0, 1]. Points
/// without beams have about 0.3.
double share_of_beams(const Points& points, const Rays& rays) {
  double sum = 0.0;
  const std::vector<Neighbours> all = neighbours(points, rays);
  for (const Neighbours& pair : all) {
    sum += weight_of(rays.elevation(pair.second) - rays.elevation(pair.first), kSharp);
  }
  return sum / static_cast<double>(std::max<std::size_t>(1, all.size()));
}

/// Gauss-Newton steps with Cauchy weights, whose scale shrinks.
Rays refine(const Points& points, Rays rays) {
  constexpr double kMaxStep = 1.0;  // m
  for (const double degrees : {0.1, 0.1, 0.05, 0.05, 0.03, 0.03}) {
    const std::vector<Neighbours> pairs = neighbours(points, rays);
    for (int k = 0; k < 2; ++k) {
      RayEquations equations;
      for (const Neighbours& pair : pairs) {
        const double change = rays.elevation(pair.second) - rays.elevation(pair.first);
        const RayEquations::Vector first = rays.derivative(pair.first);
        RayEquations::Vector J = rays.derivative(pair.second);
        for (std::size_t i = 0; i < J.size(); ++i) J[i] -= first[i];
        equations.add(J, change, weight_of(change, degrees * kRadians));
      }
      // Keeps what the points do not determine.
      const double some = 1e-9 * static_cast<double>(pairs.size());
      for (std::size_t i = 0; i < 5; ++i) equations.attract(i, 0.0, some * (i < 3 ? 1.0 : 100.0));
      const RayEquations::Vector step = equations.solve();
      const Eigen::Vector3d way(step[0], step[1], step[2]);
      const double ratio = std::min(1.0, kMaxStep / way.norm());
      const Eigen::Vector3d tilt = step[3] * rays.side() + step[4] * rays.front();
      if (!way.allFinite() || !tilt.allFinite()) return rays;
      rays.origin += ratio * way;
      rays.axis = (rays.axis + ratio * tilt).normalized();
    }
  }
  return rays;
}

/// Median distance of the elevations of points from their median, rad.
double spread_of(const Points& points, const Rays& rays) {
  std::vector<double> elevations;
  for (const Eigen::Vector3d& p : points) elevations.push_back(rays.elevation(p));
  const double middle = median(elevations);
  for (double& elevation : elevations) elevation = std::abs(elevation - middle);
  return median(std::move(elevations));
}

/// The origin of the beams in a scan, m, if it is certain and not that of the scan.
std::optional<Eigen::Vector3d> other_origin_of(const RecordedScan& scan) {
  constexpr double kRight = 0.9;     // share of beams of a right origin
  constexpr double kCertain = 0.96;  // the same; then no other is searched for
  const PointBuffer finite = finite_points(scan);
  Points points;
  for (std::size_t i = 0; i < finite.size(); ++i) {
    points.push_back(Eigen::Vector3f(finite.x[i], finite.y[i], finite.z[i]).cast<double>());
  }
  const double as_given = share_of_beams(points, {});
  if (as_given > kCertain) return std::nullopt;
  Rays best;
  double share = 0.0;
  for (const double height : {0.0, 1.0, 2.0}) {  // m
    const Rays rays = refine(points, {Eigen::Vector3d(0.0, 0.0, height)});
    const double found = share_of_beams(points, rays);
    if (found <= share) continue;
    share = found;
    best = rays;
    if (share > kRight) break;
  }
  if (share < kRight || 1.0 - share > 0.5 * (1.0 - as_given)) return std::nullopt;
  // From within a plane, all of its points seem to be of one beam.
  if (spread_of(points, best) < 10.0 * kSharp) return std::nullopt;
  return best.origin;
}

}  // namespace

std::optional<Eigen::Vector3d> other_ray_origin(const Recording& recording) {
  constexpr std::size_t kScans = 3;
  constexpr double kSame = 0.2;  // m
  constexpr double kFar = 0.3;   // m
  if (recording.size() < 2 || !recording.sensors().empty()) return std::nullopt;
  const auto found = in_two_threads(kScans, [&](std::size_t k) {
    return other_origin_of(recording.read_scan((2 * k + 1) * recording.size() / (2 * kScans)));
  });
  std::array<std::vector<double>, 3> places;
  for (const auto& one : found) {
    if (!one) return std::nullopt;
    for (Eigen::Index axis = 0; axis < 3; ++axis) places[std::size_t(axis)].push_back((*one)[axis]);
  }
  const Eigen::Vector3d origin(median(places[0]), median(places[1]), median(places[2]));
  const bool is_one = std::all_of(found.begin(), found.end(),
                                  [&](const auto& one) { return (*one - origin).norm() < kSame; });
  // Where the motion within scans was compensated, beams begin along the way of the sensor.
  std::vector<double> ways;
  for (std::size_t i = 1; i < recording.size(); ++i) {
    ways.push_back(motion_between(recording, i - 1, i).translation().norm());
  }
  const bool is_far =
      std::abs(origin.z()) > kFar || origin.head<2>().norm() > kFar + median(std::move(ways));
  if (!is_one || !is_far) return std::nullopt;
  return recording.sensor_origin() + (origin.array() * 100.0).round().matrix() / 100.0;
}

}  // namespace dynains
