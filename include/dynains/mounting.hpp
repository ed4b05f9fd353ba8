// How a sensor is mounted, from what it sees: height over the ground and tilt.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "dynains/detail/plane_fit.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// Where the ground is, seen from the sensor.
struct Mounting {
  double height = 0.0;  ///< m, distance of the sensor from the ground around it
  Eigen::Vector3d up_sensor = Eigen::Vector3d::UnitZ();  ///< normal of that ground, unit length
  bool known = false;                                    ///< false: no ground was found

  /// Angle between the z axis of the sensor and the normal of the ground, degrees. Above 90 the
  /// sensor hangs upside down.
  double tilt() const { return std::acos(std::clamp(up_sensor.z(), -1.0, 1.0)) * 180.0 / M_PI; }
};

namespace detail {

/// Plane through the ground: `up . p = -height`.
struct GroundHypothesis {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double height = 0.0;

  double distance(const Eigen::Vector3d& p) const { return up.dot(p) + height; }
};

/// Finds the plane that carries the scene: as much area as possible on it, as little as possible
/// below it.
class MountingEstimator {
 public:
  explicit MountingEstimator(PointsView points) : cells_(thin(points)) {}

  /// The ground below the sensor (`side` 1) or, for one that hangs upside down, above it (-1).
  std::optional<GroundHypothesis> find(double side) const {
    if (cells_.size() < kFewestCells) return std::nullopt;
    const std::optional<GroundHypothesis> coarse = search(side);
    if (!coarse) return std::nullopt;
    GroundHypothesis ground = *coarse;
    for (const double band : {0.3, 0.2, 0.12, 0.12, 0.12}) {
      if (!refine(band, side, ground)) return std::nullopt;
    }
    return is_sound(ground) ? std::optional(ground) : std::nullopt;
  }

 private:
  static constexpr double kReach = 20.0;         // m; beyond, the ground is another one
  static constexpr double kCell = 0.5;           // m; one point for each, whatever the density
  static constexpr double kNearest = 0.4;        // m; nearer points are the housing
  static constexpr double kLowest = 0.2;         // m, height of the sensor
  static constexpr double kHighest = 5.0;        // m, height of the sensor
  static constexpr double kLeastUpright = 0.64;  // cosine of a tilt of 50 deg
  static constexpr double kOnGround = 0.12;      // m, off the plane
  static constexpr double kBelow = 0.4;          // m under the plane: the ground is lower
  static constexpr std::size_t kFewestCells = 60;
  static constexpr std::size_t kScored = 2000;  // cells by which hypotheses are compared
  static constexpr int kTrials = 3000;

  static std::vector<Eigen::Vector3d> thin(PointsView points) {
    struct Keyed {
      std::uint64_t key;
      Eigen::Vector3f point;
    };
    std::vector<Keyed> keyed;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3f p(points.x[i], points.y[i], points.z[i]);
      const float range = p.norm();
      if (!(range > kNearest && range < kReach)) continue;
      std::uint64_t key = 0;
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        key = key << 16U | static_cast<std::uint64_t>(std::floor(p[axis] / kCell) + 1024.0);
      }
      keyed.push_back({key, p});
    }
    // Stable, so that the sums below are the same for every standard library.
    std::stable_sort(keyed.begin(), keyed.end(),
                     [](const Keyed& a, const Keyed& b) { return a.key < b.key; });
    std::vector<Eigen::Vector3d> cells;
    for (std::size_t begin = 0; begin < keyed.size();) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      std::size_t end = begin;
      while (end < keyed.size() && keyed[end].key == keyed[begin].key) {
        sum += keyed[end++].point.cast<double>();
      }
      cells.emplace_back(sum / static_cast<double>(end - begin));
      begin = end;
    }
    // In random order, so that any part is a fair sample.
    std::mt19937_64 random(1);
    for (std::size_t i = cells.size(); i > 1; --i) std::swap(cells[i - 1], cells[random() % i]);
    return cells;
  }

  /// Random planes through three cells.
  std::optional<GroundHypothesis> search(double side) const {
    const std::size_t scored = std::min(kScored, cells_.size());
    std::mt19937_64 random(2);
    std::optional<GroundHypothesis> best;
    double best_score = 0.0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const Eigen::Vector3d& a = cells_[random() % cells_.size()];
      const Eigen::Vector3d& b = cells_[random() % cells_.size()];
      const Eigen::Vector3d& c = cells_[random() % cells_.size()];
      const Eigen::Vector3d normal = (b - a).cross(c - a);
      const double area = normal.norm();
      if (!(area > 4.0)) continue;
      GroundHypothesis ground;
      ground.up = normal * ((normal.z() * side > 0.0 ? 1.0 : -1.0) / area);
      ground.height = -ground.up.dot(a);
      if (!is_possible(ground, side)) continue;
      double score = 0.0;
      for (std::size_t i = 0; i < scored; ++i) {
        const double distance = ground.distance(cells_[i]);
        // Falls off smoothly, so that the middle of the ground wins over its edge.
        if (std::abs(distance) < 2.0 * kOnGround) {
          score += 1.0 - std::abs(distance) / (2.0 * kOnGround);
        } else if (distance < -kBelow) {
          score -= 0.5;
        }
      }
      if (score > best_score) {
        best_score = score;
        best = ground;
      }
    }
    return best;
  }

  static bool is_possible(const GroundHypothesis& ground, double side) {
    return ground.up.z() * side > kLeastUpright && ground.height > kLowest &&
           ground.height < kHighest;
  }

  /// Least squares over the cells within `band` of the plane, near ones first: far ground bends
  /// away on slopes. False if too few are left.
  bool refine(double band, double side, GroundHypothesis& ground) const {
    PlaneMoments m;
    const double reach = 4.0 * ground.height + 3.0;
    for (const Eigen::Vector3d& p : cells_) {
      const double distance = ground.distance(p);
      if (!(std::abs(distance) < band)) continue;
      const double off = distance / band;
      const double far = p.squaredNorm() / (reach * reach);
      const double w = (1.0 - off * off) * (1.0 - off * off) / (1.0 + far * far);
      m.count += w;
      m.x += w * p.x();
      m.y += w * p.y();
      m.z += w * p.z();
      m.xx += w * p.x() * p.x();
      m.xy += w * p.x() * p.y();
      m.xz += w * p.x() * p.z();
      m.yy += w * p.y() * p.y();
      m.yz += w * p.y() * p.z();
      m.zz += w * p.z() * p.z();
    }
    if (!(m.count >= 10.0)) return false;
    const Plane plane = fit_plane(m);
    ground.up = side * Eigen::Vector3d(plane.normal_x, plane.normal_y, plane.normal_z);
    ground.height = -ground.up.dot(Eigen::Vector3d(plane.mean_x, plane.mean_y, plane.mean_z));
    return is_possible(ground, side);
  }

  /// Whether enough of the scene lies on the plane, and little below it.
  bool is_sound(const GroundHypothesis& ground) const {
    std::size_t on = 0;
    std::size_t below = 0;
    for (const Eigen::Vector3d& p : cells_) {
      const double distance = ground.distance(p);
      if (std::abs(distance) < kOnGround) ++on;
      if (distance < -kBelow) ++below;
    }
    return on >= kFewestCells && on * 20 >= cells_.size() && below < on;
  }

  std::vector<Eigen::Vector3d> cells_;  // sensor frame, m
};

}  // namespace detail

/// Height and tilt of the sensor that took a scan (sensor frame, metres), from the plane of the
/// ground within 20 m. On a slope, "up" is the normal of the slope. Sensors 0.2 to 5 m above the
/// ground, tilted by up to 45 degrees or hanging upside down by the same tolerance; the axes may
/// point anywhere around the vertical. Unknown if the scan shows too little ground. Points that are
/// not finite are ignored.
///
/// Allocates and takes tens of milliseconds: meant for a few scans of a sensor, not for each. The
/// median over several scans is steadier than one of them.
inline Mounting estimate_mounting(PointsView points) {
  const detail::MountingEstimator estimator(points);
  for (const double side : {1.0, -1.0}) {
    if (const auto ground = estimator.find(side)) return {ground->height, ground->up, true};
  }
  return {};
}

}  // namespace dynains
