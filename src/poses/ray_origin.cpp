#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
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
constexpr double kNear = 1.2 * kRadians;  // of azimuth, more than the step of any sensor
constexpr double kFar = 0.3;              // m, between origins; less does not count

using Points = std::vector<Eigen::Vector3d>;
using RayEquations = detail::NormalEquations<5>;

/// Beams that turn about an axis through their origin.
struct Rays {
  Eigen::Vector3d origin;  // m
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

/// A point as it is seen from the origin of the beams, rad.
struct SeenPoint {
  double azimuth, elevation;
  std::size_t point;
};

/// The points by their azimuth.
std::vector<SeenPoint> seen_points(const Points& points, const Rays& rays) {
  std::vector<SeenPoint> seen;
  const Eigen::Vector3d side = rays.side(), front = rays.front();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d q = points[i] - rays.origin;
    if (!(q.norm() > 0.5 * kMinPoint)) continue;
    seen.push_back({std::atan2(front.dot(q), side.dot(q)), rays.elevation(points[i]), i});
  }
  std::sort(seen.begin(), seen.end(), [](const SeenPoint& a, const SeenPoint& b) {
    return std::pair(a.azimuth, a.point) < std::pair(b.azimuth, b.point);
  });
  return seen;
}

/// Change of the elevation (rad) from a point to its neighbour on a beam.
struct Change {
  double size;
  RayEquations::Vector derivative;  // see Rays::derivative()
};

/// For about 4,000 of `points`, the nearest point within the next step of azimuth. Both are of the
/// same beam, also under a wrong origin, unless rings lie closer than the points on a ring.
std::vector<Change> changes_along_beams(const Points& points, const std::vector<SeenPoint>& seen,
                                        const Rays& rays) {
  constexpr std::size_t kCount = 4000;
  constexpr double kSteep = 0.5;  // ratio of the changes of elevation and azimuth
  std::vector<Change> changes;
  for (std::size_t i = 0; i < seen.size(); i += 1 + seen.size() / kCount) {
    const Eigen::Vector3d& first = points[seen[i].point];
    const SeenPoint* next = nullptr;
    double nearest = 0.0;
    for (std::size_t k = i + 1; k < seen.size(); ++k) {
      if (seen[k].azimuth - seen[i].azimuth > kNear) break;
      const double distance = (points[seen[k].point] - first).squaredNorm();
      if (next != nullptr && distance >= nearest) continue;
      next = &seen[k];
      nearest = distance;
    }
    if (next == nullptr) continue;
    const double across = next->elevation - seen[i].elevation;
    if (!(std::abs(across) < kSteep * (next->azimuth - seen[i].azimuth))) continue;
    Change change{across, rays.derivative(points[next->point])};
    const RayEquations::Vector before = rays.derivative(first);
    for (std::size_t k = 0; k < before.size(); ++k) change.derivative[k] -= before[k];
    changes.push_back(change);
  }
  return changes;
}

double median_size(const std::vector<Change>& changes) {
  std::vector<double> sizes;
  sizes.reserve(changes.size());
  for (const Change& change : changes) sizes.push_back(std::abs(change.size));
  return median(std::move(sizes));
}

/// Median distance of the elevations from their median, rad.
double spread_of(const std::vector<SeenPoint>& seen) {
  std::vector<double> elevations;
  elevations.reserve(seen.size());
  for (const SeenPoint& point : seen) elevations.push_back(point.elevation);
  const double middle = median(elevations);
  for (double& elevation : elevations) elevation = std::abs(elevation - middle);
  return median(std::move(elevations));
}

/// How many more of the points than of directions above them have an elevation (within `near`, rad)
/// that occurs again behind the next step of azimuth, as a share. About 0 unless beams turn.
double share_on_rings(const std::vector<SeenPoint>& seen, double near) {
  constexpr std::size_t kCount = 1000;
  std::size_t on_rings = 0, by_chance = 0, count = 0;
  for (std::size_t i = 0, aside = 0; i < seen.size(); i += 1 + seen.size() / kCount) {
    const double elevation = seen[i].elevation, begin = seen[i].azimuth + kNear;
    while (aside < seen.size() && seen[aside].azimuth < begin) ++aside;
    const double above = elevation + kNear * std::fmod(0.618 * double(++count), 1.0);
    bool is_on_ring = false, is_by_chance = false;
    for (std::size_t k = aside; k < seen.size() && seen[k].azimuth < begin + kNear; ++k) {
      is_on_ring = is_on_ring || std::abs(seen[k].elevation - elevation) < near;
      is_by_chance = is_by_chance || std::abs(seen[k].elevation - above) < near;
    }
    on_rings += is_on_ring ? 1 : 0;
    by_chance += is_by_chance ? 1 : 0;
  }
  return (double(on_rings) - double(by_chance)) / double(count - by_chance + 1);
}

/// Equations of the origin and the axis, with Cauchy weights of this scale (rad).
RayEquations equations_of(const std::vector<Change>& changes, double scale) {
  RayEquations equations;
  for (const auto& [size, derivative] : changes) {
    equations.add(derivative, size, 1.0 / (1.0 + size * size / (scale * scale)));
  }
  // Keeps what the points do not determine.
  const double some = 1e-9 * static_cast<double>(changes.size());
  for (std::size_t i = 0; i < 5; ++i) equations.attract(i, 0.0, some * (i < 3 ? 1.0 : 100.0));
  return equations;
}

/// The origin of beams, m, and its deviation by axis, m.
struct RayOrigin {
  Eigen::Vector3d place, deviation;
};

/// Gauss-Newton steps from an origin at this height (m). The scale of their weights is the median
/// change of the elevation along a beam, which shrinks to the noise of the directions. They end
/// where the given origin fits. Empty if there is no end, or if points do not lie on rings around
/// it. Straight above the given origin unless changes are far larger there: noise seems smaller
/// from aside, farther from near points.
std::optional<RayOrigin> fit_origin(const Points& points, double height) {
  constexpr int kMaxSteps = 15;
  constexpr double kMinScale = 1e-5;                // rad, as coordinates are rounded
  constexpr double kMinOnRings = 0.3, kSame = 3.0;  // ratios
  // From within a plane, such as the ground, all of its points seem to be of one beam.
  constexpr double kMinSpread = 0.5 * kRadians;
  constexpr double kFarthest = 6.0;  // m, beyond any vehicle; from afar, other patterns seem flat
  Rays rays{{0.0, 0.0, height}};
  for (int k = 0; k < kMaxSteps; ++k) {
    const std::vector<SeenPoint> seen = seen_points(points, rays);
    const std::vector<Change> changes = changes_along_beams(points, seen, rays);
    const double scale = std::max(median_size(changes), kMinScale);
    const RayEquations equations = equations_of(changes, scale);
    const RayEquations::Vector step = equations.solve();
    const RayEquations::Matrix covariance = equations.inverse();
    const Eigen::Vector3d way(step[0], step[1], step[2]);
    const Eigen::Vector3d tilt = step[3] * rays.side() + step[4] * rays.front();
    if (!way.allFinite() || !tilt.allFinite()) return std::nullopt;
    const Eigen::Vector3d deviation =
        scale * Eigen::Vector3d(covariance[0][0], covariance[1][1], covariance[2][2]).cwiseSqrt();
    const double ratio = 1.0 / std::max(1.0, way.norm());  // 1 m at most
    rays.origin += ratio * way;
    rays.axis = (rays.axis + ratio * tilt).normalized();
    if (rays.origin.norm() > kFarthest) break;
    // The pairs change from step to step, and the result with them by its deviation.
    const double rest = way.norm() / (0.002 + deviation.norm());
    const bool fits_given = rays.origin.norm() + way.norm() + 3.0 * deviation.norm() < kFar;
    if (!fits_given && rest > (k + 1 < kMaxSteps ? 0.5 : 3.0)) continue;
    if (share_on_rings(seen, 3.0 * scale) < kMinOnRings) break;
    if (spread_of(seen) < kMinSpread) break;
    if (rays.origin.head<2>().norm() < kFar) return RayOrigin{rays.origin, deviation};
    const Rays above{{0.0, 0.0, rays.origin.z()}, rays.axis};
    const double change =
        median_size(changes_along_beams(points, seen_points(points, above), above));
    return RayOrigin{change < kSame * scale ? above.origin : rays.origin, deviation};
  }
  return std::nullopt;
}

/// The origin of the beams in a scan if it is certain.
std::optional<RayOrigin> origin_of(const RecordedScan& scan) {
  const PointBuffer finite = finite_points(scan);
  Points points;
  for (std::size_t i = 0; i < finite.size(); ++i) {
    points.push_back(Eigen::Vector3f(finite.x[i], finite.y[i], finite.z[i]).cast<double>());
  }
  for (const double height : {0.0, 1.0, 2.0}) {  // m
    if (const auto origin = fit_origin(points, height)) return origin;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Eigen::Vector3d> other_ray_origin(const Recording& recording) {
  constexpr std::size_t kScans = 3;
  if (recording.size() < 2 || !recording.sensors().empty()) return std::nullopt;
  const auto found = in_two_threads(kScans, [&](std::size_t k) {
    return origin_of(recording.read_scan((2 * k + 1) * recording.size() / (2 * kScans)));
  });
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(), tolerance = Eigen::Vector3d::Zero();  // m
  for (const auto& one : found) {
    if (!one) return std::nullopt;
    origin += one->place / double(kScans);
  }
  for (const auto& one : found) {
    const Eigen::Vector3d error = (one->place - origin).cwiseAbs().cwiseMax(one->deviation);
    tolerance = tolerance.cwiseMax(3.0 * error);
  }
  // Where the motion within scans was compensated, beams begin along the way of the sensor.
  std::vector<double> ways;
  for (std::size_t i = 1; i < recording.size(); ++i) {
    ways.push_back(motion_between(recording, i - 1, i).translation().norm());
  }
  const double aside = tolerance.head<2>().norm() + kFar + median(std::move(ways));
  if (origin.head<2>().norm() < aside) origin.head<2>().setZero();
  const bool is_far = std::abs(origin.z()) > tolerance.z() + kFar || !origin.head<2>().isZero(0.0);
  if (!is_far) return std::nullopt;
  return recording.sensor_origin() + (origin.array() * 100.0).round().matrix() / 100.0;
}

}  // namespace dynains
