// Mounting of a sensor, its height above the ground and its tilt, estimated from one scan.
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

/// Plane of the ground around the sensor, in the sensor frame.
struct Mounting {
  double height = 0.0;  ///< m, distance of the sensor from the plane
  Eigen::Vector3d up_sensor = Eigen::Vector3d::UnitZ();  ///< upward normal, unit length
  bool known = false;                                    ///< false: no ground was found

  /// deg, angle between the z axis of the sensor and the normal; above 90 for a sensor that hangs
  /// upside down.
  double tilt() const { return std::acos(std::clamp(up_sensor.z(), -1.0, 1.0)) * 180.0 / M_PI; }

  /// The smallest rotation from the sensor frame to a level frame, which maps the normal to the z
  /// axis. For a normal along -z it is the half turn about x.
  Eigen::Matrix3d R_level_sensor() const {
    // Closed form: Quaterniond::FromTwoVectors takes seconds to compile.
    constexpr double kTiny = 1e-200;
    const double x = up_sensor.x(), y = up_sensor.y(), z = up_sensor.z();
    const double across = x * x + y * y;
    if (z < 0.0 && across < kTiny) return Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    // 1 / (1 + z), without cancellation near z = -1.
    const double k = z < 0.0 ? (1.0 - z) / across : 1.0 / (1.0 + z);
    Eigen::Matrix3d R;
    R << 1.0 - k * x * x, -k * x * y, -x,  //
        -k * x * y, 1.0 - k * y * y, -y,   //
        x, y, z;
    return R;
  }
};

/// Normal of the ground in the frame of a sensor with a pitch (deg about y, nose down) and a roll
/// (deg about x, left side up): R_level_sensor = R_y(pitch) R_x(roll).
inline Eigen::Vector3d up_of_mounting(double pitch, double roll) {
  constexpr double kRadians = M_PI / 180.0;
  const Eigen::Matrix3d R_level_sensor =
      (Eigen::AngleAxisd(pitch * kRadians, Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(roll * kRadians, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  return R_level_sensor.row(2);
}

namespace detail {

/// Plane `up . p = -height`, m, sensor frame.
struct GroundHypothesis {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double height = 0.0;

  double distance(const Eigen::Vector3d& p) const { return up.dot(p) + height; }
};

/// Finds the plane with the most area on it and the least below it: RANSAC over one point per cell,
/// then least squares.
class MountingEstimator {
 public:
  explicit MountingEstimator(PointsView points) : cells_(thin(points)) {
    for (std::size_t i = 0; i < std::min(kScored, cells_.size()); ++i) {
      const Eigen::Vector3f p = cells_[i].cast<float>();
      scored_.push_back(p.x(), p.y(), p.z());
    }
  }

  /// The ground below the sensor (`side` 1), or above it (-1) if the sensor hangs upside down.
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
  static constexpr double kMaxDistance = 20.0;   // m; farther ground may lie in another plane
  static constexpr double kCell = 0.5;           // m; one point per cell makes density irrelevant
  static constexpr double kMinDistance = 0.4;    // m; nearer points hit the housing
  static constexpr double kLowest = 0.2;         // m, height of the sensor
  static constexpr double kHighest = 5.0;        // m, height of the sensor
  static constexpr double kLeastUpright = 0.64;  // cosine of a tilt of 50 deg
  static constexpr double kOnGround = 0.12;      // m, off the plane
  static constexpr double kBelow = 0.4;          // m; cells so far below contradict a plane
  static constexpr std::size_t kFewestCells = 60;
  static constexpr int kTrials = 3000;
  static constexpr std::size_t kScreened = 200;  // cells that score every hypothesis
  static constexpr std::size_t kFinalists = 40;
  static constexpr std::size_t kScored = 2000;  // cells that score the finalists

  static bool is_near(PointsView points, std::size_t i) {
    const float range = Eigen::Vector3f(points.x[i], points.y[i], points.z[i]).norm();
    return range > kMinDistance && range < kMaxDistance;
  }

  // Mean of the points in each occupied cell, in random order: any part is a fair sample. No cells
  // if the points are too few for kFewestCells.
  static std::vector<Eigen::Vector3d> thin(PointsView points) {
    std::size_t near = 0;
    for (std::size_t i = 0; i < points.size() && near < kFewestCells; ++i) {
      if (is_near(points, i)) ++near;
    }
    if (near < kFewestCells) return {};
    constexpr auto kHalf = static_cast<std::int32_t>(kMaxDistance / kCell);
    constexpr std::size_t kWidth = 2 * static_cast<std::size_t>(kHalf);
    struct Sum {
      std::size_t cell;
      Eigen::Vector3d sum;
      double count;
    };
    std::vector<std::uint32_t> number(kWidth * kWidth * kWidth, 0);  // by cell; from 1
    std::vector<Sum> sums;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!is_near(points, i)) continue;
      const Eigen::Vector3f p(points.x[i], points.y[i], points.z[i]);
      std::size_t at = 0;
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const auto index =
            static_cast<std::int32_t>(std::floor(p[axis] / static_cast<float>(kCell)));
        at = at * kWidth + static_cast<std::size_t>(index + kHalf);
      }
      if (number[at] == 0) {
        sums.push_back({at, Eigen::Vector3d::Zero(), 0.0});
        number[at] = static_cast<std::uint32_t>(sums.size());
      }
      Sum& sum = sums[number[at] - 1];
      sum.sum += p.cast<double>();
      sum.count += 1.0;
    }
    // The order of the points must not matter.
    std::sort(sums.begin(), sums.end(), [](const Sum& a, const Sum& b) { return a.cell < b.cell; });
    std::vector<Eigen::Vector3d> cells;
    cells.reserve(sums.size());
    for (const Sum& sum : sums) cells.emplace_back(sum.sum / sum.count);
    std::mt19937_64 random(1);
    for (std::size_t i = cells.size(); i > 1; --i) std::swap(cells[i - 1], cells[random() % i]);
    return cells;
  }

  // The best of random planes through three cells.
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

  // How well the first `count_limit` cells fit a plane.
  float score(const GroundHypothesis& ground, std::size_t count_limit) const {
    const Float8 x(static_cast<float>(ground.up.x()));
    const Float8 y(static_cast<float>(ground.up.y()));
    const Float8 z(static_cast<float>(ground.up.z()));
    const Float8 height(static_cast<float>(ground.height));
    const Float8 zero(0.0F), one(1.0F), half(0.5F);
    const Float8 slope(static_cast<float>(0.5 / kOnGround));
    const Float8 below(static_cast<float>(-kBelow));
    Float8 total(0.0F);
    // Whole packs only; the few cells left over do not matter.
    const std::size_t count = std::min(count_limit, cells_.size()) / kPackWidth * kPackWidth;
    for (std::size_t i = 0; i < count; i += kPackWidth) {
      const Float8 distance = (x * Float8::load(&scored_.x[i]) + y * Float8::load(&scored_.y[i])) +
                              (z * Float8::load(&scored_.z[i]) + height);
      // A smooth fall-off prefers the middle of a rough ground to its edge.
      total = total + max(one - abs(distance) * slope, zero) - keep(distance < below, half);
    }
    return sum(total);
  }

  static bool is_possible(const GroundHypothesis& ground, double side) {
    return ground.up.z() * side > kLeastUpright && ground.height > kLowest &&
           ground.height < kHighest;
  }

  // Weighted least squares over the cells within `band` m of the plane. Near cells weigh more,
  // since far ground bends away on slopes. False if too few cells are left.
  bool refine(double band, double side, GroundHypothesis& ground) const {
    PlaneMoments m;
    const double near_distance = 4.0 * ground.height + 3.0;
    for (const Eigen::Vector3d& p : cells_) {
      const double distance = ground.distance(p);
      if (!(std::abs(distance) < band)) continue;
      const double off = distance / band;
      const double far = p.squaredNorm() / (near_distance * near_distance);
      const double w = (1.0 - off * off) * (1.0 - off * off) / (1.0 + far * far);
      m.add(p.x(), p.y(), p.z(), w);
    }
    if (!(m.count >= 10.0)) return false;
    const Plane plane = fit_plane(m);
    ground.up = side * Eigen::Vector3d(plane.normal_x, plane.normal_y, plane.normal_z);
    ground.height = -ground.up.dot(Eigen::Vector3d(plane.mean_x, plane.mean_y, plane.mean_z));
    return is_possible(ground, side);
  }

  // Whether enough cells lie on the plane, and few below it.
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

  std::vector<Eigen::Vector3d> cells_;  // m, sensor frame
  PointBuffer scored_;                  // the first kScored of them
};

}  // namespace detail

/// Estimates height and tilt of a sensor from one scan (m, sensor frame), by the plane of the
/// ground within 20 m. On a slope, the normal is that of the slope.
///
/// Valid for sensors 0.2 to 5 m above the ground that are tilted by up to 45 deg, upright or upside
/// down, with any heading. Not known if the scan shows too little ground. Ignores points that are
/// not finite. Allocates and takes milliseconds: meant for a few scans of a sensor, not for each;
/// the median over several scans is steadier.
inline Mounting estimate_mounting(PointsView points) {
  const detail::MountingEstimator estimator(points);
  for (const double side : {1.0, -1.0}) {
    if (const auto ground = estimator.find(side)) return {ground->height, ground->up, true};
  }
  return {};
}

}  // namespace dynains
