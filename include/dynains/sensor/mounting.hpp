// How a sensor is mounted, from what it sees: height over the ground and tilt.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "dynains/ground/plane_fit.hpp"
#include "dynains/points.hpp"
#include "dynains/simd/lanes.hpp"

namespace dynains {

/// Where the ground is, seen from the sensor.
struct Mounting {
  double height = 0.0;  ///< m, distance of the sensor from the ground around it
  Eigen::Vector3d up_sensor = Eigen::Vector3d::UnitZ();  ///< normal of that ground, unit length
  bool known = false;                                    ///< false: no ground was found

  /// Angle between the z axis of the sensor and the normal of the ground, degrees. Above 90 the
  /// sensor hangs upside down.
  double tilt() const { return std::acos(std::clamp(up_sensor.z(), -1.0, 1.0)) * 180.0 / M_PI; }

  /// The smallest turn that brings the normal of the ground to the z axis: from the frame of the
  /// sensor to that of one mounted level in its place. Of all half turns that do for a normal that
  /// points straight down, it is the one about x.
  Eigen::Matrix3d R_level_sensor() const {
    // In closed form: that of Eigen, which any two vectors do for, takes seconds to compile.
    constexpr double kTiny = 1e-200;
    const double x = up_sensor.x(), y = up_sensor.y(), z = up_sensor.z();
    const double across = x * x + y * y;
    if (z < 0.0 && across < kTiny) return Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    // 1 / (1 + z), also where next to nothing is left of 1 + z.
    const double k = z < 0.0 ? (1.0 - z) / across : 1.0 / (1.0 + z);
    Eigen::Matrix3d R;
    R << 1.0 - k * x * x, -k * x * y, -x,  //
        -k * x * y, 1.0 - k * y * y, -y,   //
        x, y, z;
    return R;
  }
};

/// Normal of the ground seen from a sensor that was pitched (about y, nose down) and rolled (about
/// x, left side up) by so many degrees: R_level_sensor = R_y(pitch) R_x(roll).
inline Eigen::Vector3d up_of_mounting(double pitch, double roll) {
  constexpr double kRadians = M_PI / 180.0;
  const Eigen::Matrix3d R_level_sensor =
      (Eigen::AngleAxisd(pitch * kRadians, Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(roll * kRadians, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  return R_level_sensor.row(2);
}

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
  explicit MountingEstimator(PointsView points) : cells_(thin(points)) {
    for (std::size_t i = 0; i < std::min(kScored, cells_.size()); ++i) {
      const Eigen::Vector3f p = cells_[i].cast<float>();
      scored_.push_back(p.x(), p.y(), p.z());
    }
  }

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
  static constexpr int kTrials = 3000;
  static constexpr std::size_t kScreened = 200;  // cells by which all hypotheses are compared
  static constexpr std::size_t kFinalists = 40;
  static constexpr std::size_t kScored = 2000;  // cells by which the best are compared

  // One point for each cell that was hit, the mean of those in it.
  static std::vector<Eigen::Vector3d> thin(PointsView points) {
    constexpr auto kHalf = static_cast<std::int32_t>(kReach / kCell);
    constexpr std::size_t kWidth = 2 * static_cast<std::size_t>(kHalf);
    struct Sum {
      std::size_t place;
      Eigen::Vector3d sum;
      double count;
    };
    std::vector<std::uint32_t> number(kWidth * kWidth * kWidth, 0);  // of a place, from 1
    std::vector<Sum> sums;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3f p(points.x[i], points.y[i], points.z[i]);
      const float range = p.norm();
      if (!(range > kNearest && range < kReach)) continue;
      std::size_t place = 0;
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const auto cell =
            static_cast<std::int32_t>(std::floor(p[axis] / static_cast<float>(kCell)));
        place = place * kWidth + static_cast<std::size_t>(cell + kHalf);
      }
      if (number[place] == 0) {
        sums.push_back({place, Eigen::Vector3d::Zero(), 0.0});
        number[place] = static_cast<std::uint32_t>(sums.size());
      }
      Sum& sum = sums[number[place] - 1];
      sum.sum += p.cast<double>();
      sum.count += 1.0;
    }
    // Whatever order the points come in.
    std::sort(sums.begin(), sums.end(),
              [](const Sum& a, const Sum& b) { return a.place < b.place; });
    std::vector<Eigen::Vector3d> cells;
    cells.reserve(sums.size());
    for (const Sum& sum : sums) cells.emplace_back(sum.sum / sum.count);
    // In random order, so that any part is a fair sample.
    std::mt19937_64 random(1);
    for (std::size_t i = cells.size(); i > 1; --i) std::swap(cells[i - 1], cells[random() % i]);
    return cells;
  }

  /// Random planes through three cells: all are compared by a few cells, the best by many.
  std::optional<GroundHypothesis> search(double side) const {
    struct Candidate {
      GroundHypothesis ground;
      float score;
    };
    const auto is_better = [](const Candidate& a, const Candidate& b) { return a.score > b.score; };
    std::vector<Candidate> candidates;
    std::mt19937_64 random(2);
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
      if (is_possible(ground, side)) candidates.push_back({ground, score(ground, kScreened)});
    }
    std::stable_sort(candidates.begin(), candidates.end(), is_better);
    if (candidates.size() > kFinalists) candidates.resize(kFinalists);
    for (Candidate& candidate : candidates) candidate.score = score(candidate.ground, kScored);
    const auto best =
        std::max_element(candidates.begin(), candidates.end(),
                         [](const Candidate& a, const Candidate& b) { return a.score < b.score; });
    if (best == candidates.end() || !(best->score > 0.0F)) return std::nullopt;
    return best->ground;
  }

  /// How well the first `most` cells fit a plane.
  float score(const GroundHypothesis& ground, std::size_t most) const {
    const Float8 x(static_cast<float>(ground.up.x()));
    const Float8 y(static_cast<float>(ground.up.y()));
    const Float8 z(static_cast<float>(ground.up.z()));
    const Float8 height(static_cast<float>(ground.height));
    const Float8 zero(0.0F), one(1.0F), half(0.5F);
    const Float8 slope(static_cast<float>(0.5 / kOnGround));
    const Float8 below(static_cast<float>(-kBelow));
    Float8 total(0.0F);
    // Whole groups of lanes; there are many more cells than the few left over.
    const std::size_t count = std::min(most, cells_.size()) / kPackWidth * kPackWidth;
    for (std::size_t i = 0; i < count; i += kPackWidth) {
      const Float8 distance = (x * Float8::load(&scored_.x[i]) + y * Float8::load(&scored_.y[i])) +
                              (z * Float8::load(&scored_.z[i]) + height);
      // Falls off smoothly, so that the middle of the ground wins over its edge.
      total = total + max(one - abs(distance) * slope, zero) - keep(distance < below, half);
    }
    return sum(total);
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
      m.add(p.x(), p.y(), p.z(), w);
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
  PointBuffer scored_;                  // the first of them
};

}  // namespace detail

/// Height and tilt of the sensor that took a scan (sensor frame, metres), from the plane of the
/// ground within 20 m. On a slope, "up" is the normal of the slope. Sensors 0.2 to 5 m above the
/// ground, tilted by up to 45 degrees or hanging upside down by the same tolerance; the axes may
/// point anywhere around the vertical. Unknown if the scan shows too little ground. Points that are
/// not finite are ignored.
///
/// Allocates and takes milliseconds: meant for a few scans of a sensor, not for each. The
/// median over several scans is steadier than one of them.
inline Mounting estimate_mounting(PointsView points) {
  const detail::MountingEstimator estimator(points);
  for (const double side : {1.0, -1.0}) {
    if (const auto ground = estimator.find(side)) return {ground->height, ground->up, true};
  }
  return {};
}

}  // namespace dynains
