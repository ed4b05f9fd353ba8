// Returns from the vehicle or robot that carries the sensor.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <utility>
#include <vector>

#include "dynains/median.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/sensor/mounting.hpp"
#include "dynains/sensor/sensor_model.hpp"

namespace dynains {

/// The part of the own vehicle or robot that a sensor sees.
struct OwnBody {
  bool known = false;  ///< whether the scans were enough for a statement
  double reach = 0.0;  ///< m, largest horizontal distance of its returns; 0: the sensor sees none

  /// RemoverConfig::min_range that excludes the body, m. At least 1 m, where the ground zones
  /// begin.
  double min_range() const {
    constexpr double kMargin = 0.3;  // a beam may hit what lies behind its nearest return
    return std::max(1.0, reach + kMargin);
  }
};

namespace detail {

/// Cells of directions, NearestReturns.
struct DirectionCells {
  float column = 2.0F;  ///< deg of azimuth
  float row = 1.0F;     ///< deg of elevation
  std::size_t columns = 181, rows = 182;
};

/// The nearest return of each direction, scan by scan, and the nearest ground of each azimuth, as
/// far from the sensor as a body may reach.
class NearestReturns {
 public:
  static constexpr float kMaxRange = 4.5F;  // m, horizontal

  struct Return {
    float range = std::numeric_limits<float>::infinity();  // m
    Eigen::Vector3f point = Eigen::Vector3f::Zero();       // m, sensor frame
    friend bool operator<(const Return& a, const Return& b) { return a.range < b.range; }
  };

  explicit NearestReturns(const Mounting& mounting)
      : mounting_(mounting), by_direction_(kCells.columns * kCells.rows), ground_(kCells.columns) {}

  void add(PointsView points) {
    near_.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float x = points.x[i], y = points.y[i];
      if (x * x + y * y < kMaxRange * kMaxRange) near_.push_back(x, y, points.z[i]);
    }
    const BeamAngles angles = beam_angles(near_);
    nearest_.assign(by_direction_.size(), {});
    nearest_ground_.assign(kCells.columns, std::numeric_limits<float>::infinity());
    for (std::size_t i = 0; i < near_.size(); ++i) {
      const Eigen::Vector3f p(near_.x[i], near_.y[i], near_.z[i]);
      const float range = p.norm();
      if (!(range > 0.0F)) continue;
      const std::size_t d = direction(angles.azimuth[i], angles.elevation[i]);
      if (range < nearest_[d].range) nearest_[d] = {range, p};
      if (height_of(p) < 0.25) {  // m
        float& ground = nearest_ground_[d / kCells.rows];
        ground = std::min(ground, p.head<2>().norm());
      }
    }
    ranges_.emplace_back();
    for (std::size_t d = 0; d < nearest_.size(); ++d) {
      ranges_.back().push_back(nearest_[d].range);
      if (std::isfinite(nearest_[d].range)) by_direction_[d].push_back(nearest_[d]);
    }
    for (std::size_t c = 0; c < kCells.columns; ++c) ground_[c].push_back(nearest_ground_[c]);
  }

  /// How the returns of scan `i` around the direction of a point (m, its sensor frame) compare with
  /// the point: 1 if one lies there, -1 if beams pass it, 0 if it is hidden, or no beam is near.
  int seen_at(std::size_t i, const Eigen::Vector3f& p) const {
    constexpr float kDegrees = 180.0F / static_cast<float>(M_PI);
    constexpr std::size_t kAround = 2;  // rows, as beams of a sparse sensor are 2 deg apart
    const float horizontal = p.head<2>().norm();
    if (!(horizontal < kMaxRange)) return 0;
    const std::size_t at =
        direction(kDegrees * std::atan2(p.y(), p.x()), kDegrees * std::atan2(p.z(), horizontal));
    float beyond = std::numeric_limits<float>::infinity();  // m, of the nearest to the point
    for (std::size_t d = std::max(at, kAround) - kAround; d <= at + kAround; ++d) {
      if (d >= ranges_[i].size()) break;
      const float one = ranges_[i][d] - p.norm();
      if (std::abs(one) < std::abs(beyond)) beyond = one;
    }
    const float tolerance = 0.1F * (1.0F + p.norm());
    if (std::isinf(beyond) || beyond < -tolerance) return 0;
    return beyond > tolerance ? -1 : 1;
  }

  /// Height of a point above the ground, m; infinite if the ground is not known.
  double height_of(const Eigen::Vector3f& p) const {
    if (!mounting_.known) return std::numeric_limits<double>::infinity();
    return mounting_.up_sensor.dot(p.cast<double>()) + mounting_.height;
  }

  /// Calls `visit(returns, ground)` for each direction with returns, which may be reordered.
  /// `ground`: usual horizontal distance of the nearest ground in that azimuth, m, or infinity.
  template <class Visit>
  void for_each_direction(Visit&& visit) {
    for (std::size_t d = 0; d < by_direction_.size(); ++d) {
      if (!by_direction_[d].empty()) visit(by_direction_[d], median(ground_[d / kCells.rows]));
    }
  }

 private:
  static constexpr DirectionCells kCells{};

  static std::size_t direction(float azimuth, float elevation) {
    return cell(azimuth + 180.5F, kCells.column, kCells.columns) * kCells.rows +
           cell(elevation + 90.5F, kCells.row, kCells.rows);
  }
  static std::size_t cell(float angle, float size, std::size_t count) {
    return std::min(static_cast<std::size_t>(angle / size), count - 1);
  }

  Mounting mounting_;
  std::vector<std::vector<Return>> by_direction_;
  std::vector<std::vector<float>> ground_;  // by azimuth, scan by scan
  std::vector<std::vector<float>> ranges_;  // m, of the nearest returns, by scan and direction
  PointBuffer near_;
  std::vector<Return> nearest_;
  std::vector<float> nearest_ground_;
};

/// The usual nearest return of a direction.
struct SteadyReturn {
  Eigen::Vector3f point = Eigen::Vector3f::Zero();  // m, sensor frame
  double reach = 0.0;   // m, largest horizontal distance of the returns like it
  double steady = 0.0;  // ratio of the scans with a return like it
};

/// `returns`: the nearest returns of a direction in `scans` scans. `height`: of a point above the
/// ground, m. `ground`: distance of the nearest ground in this azimuth, m. `steady` is 0 for
/// returns that cannot come from the body, which hides the ground below it.
template <class Height>
SteadyReturn steady_return(std::vector<NearestReturns::Return>& returns, std::size_t scans,
                           Height&& height, double ground) {
  constexpr float kTolerance = 0.03F;  // m, and as a ratio of the range
  const NearestReturns::Return usual = median(returns);
  const auto distance = static_cast<double>(usual.point.head<2>().norm());
  // Behind visible ground, or ground: the height of the sensor is known to 0.3 m.
  if (distance > ground + 0.3 || height(usual.point) < 0.4) return {};
  std::size_t alike = 0;
  SteadyReturn result;
  result.point = usual.point;
  for (const NearestReturns::Return& other : returns) {
    if (std::abs(other.range - usual.range) > kTolerance * (1.0F + usual.range)) continue;
    ++alike;
    result.reach = std::max(result.reach, static_cast<double>(other.point.head<2>().norm()));
  }
  result.steady = static_cast<double>(alike) / static_cast<double>(scans);
  return result;
}

/// For each scan the motion from it to another one, the farthest within 3 m, where most of the near
/// things are seen again.
inline std::vector<std::pair<std::size_t, Pose>> motions_nearby(const std::vector<Pose>& poses) {
  std::vector<std::pair<std::size_t, Pose>> result;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    double farthest = -1.0;
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const Pose T_k_i = poses[k].inverse() * poses[i];
      const double distance = T_k_i.translation().norm();
      if (k == i || distance > 3.0 || distance <= farthest) continue;
      if (farthest >= 0.0) result.pop_back();
      result.emplace_back(k, T_k_i);
      farthest = distance;
    }
  }
  return result;
}

/// Whether a steady point (m, sensor frame) keeps its place in the world, as the walls of a
/// corridor do and everything around a sensor that stands.
inline bool keeps_its_place(const Eigen::Vector3f& point, const NearestReturns& nearest,
                            const std::vector<std::pair<std::size_t, Pose>>& motions) {
  int balance = 0, seen = 0;
  for (const auto& [scan, T] : motions) {
    const int one = nearest.seen_at(scan, (T * point.cast<double>()).cast<float>());
    balance += one;
    seen += std::abs(one);
  }
  return seen > 0 && balance >= 0;
}

/// Leaves out candidates beside those that keep their place in the world, whose own places no other
/// scan may see.
inline void leave_out_beside(const std::vector<SteadyReturn>& fixed,
                             std::vector<SteadyReturn>& candidates) {
  constexpr float kBeside = 0.3F;  // m
  const auto is_beside = [&](const SteadyReturn& one) {
    return std::any_of(fixed.begin(), fixed.end(), [&](const SteadyReturn& other) {
      return (other.point - one.point).norm() < kBeside;
    });
  };
  candidates.erase(std::remove_if(candidates.begin(), candidates.end(), is_beside),
                   candidates.end());
}

/// Middle of the mountings by a few of `scans`.
inline Mounting usual_mounting(const std::vector<PointBuffer>& scans) {
  std::vector<double> heights;
  Mounting result;
  result.up_sensor.setZero();
  for (std::size_t i = 0; i < scans.size(); i += std::max<std::size_t>(1, scans.size() / 5)) {
    const Mounting one = estimate_mounting(scans[i]);
    if (!one.known) continue;
    heights.push_back(one.height);
    result.up_sensor += one.up_sensor;
  }
  if (heights.empty()) return {};
  return {median(heights), result.up_sensor.normalized(), true};
}

/// Largest horizontal distance (m) of the returns of the body: those in 85 % of the scans, and
/// those in 45 % within 0.7 m of these, as on dark or slanted metal, or in scans whose motion was
/// compensated.
inline double reach_of_body(std::vector<SteadyReturn> candidates) {
  const auto is_body = [&](const SteadyReturn& candidate) { return candidate.steady >= 0.85; };
  auto rest = std::partition(candidates.begin(), candidates.end(), is_body);
  for (auto body = candidates.begin(); body != rest; ++body) {
    rest = std::partition(rest, candidates.end(), [&](const SteadyReturn& candidate) {
      return candidate.steady >= 0.45 && (candidate.point - body->point).norm() < 0.7F;
    });
  }
  double reach = 0.0;
  for (auto body = candidates.begin(); body != rest; ++body) {
    reach = std::max(reach, body->reach);
  }
  return reach;
}

}  // namespace detail

/// Finds the returns of the own body: near ones that are constant in the sensor frame while the
/// sensor moves. `scans`: m, sensor frame, finite points; at least 8 scans. `poses`: of the sensor
/// at each of them in one static frame; what keeps its place there, as everything does around a
/// sensor that stands, is no body. Without poses, the scans must be of a drive of several metres,
/// with turns if possible. The body is assumed to end 4.5 m from the sensor, to be 0.4 m above the
/// ground, and to hide the ground below it. The result is not known for fewer scans. Allocates
/// memory and takes some tens of milliseconds, so call it once, before the first push: a stream
/// cannot know it at its first scan.
inline OwnBody estimate_own_body(const std::vector<PointBuffer>& scans,
                                 const std::vector<Pose>& poses = {}) {
  if (scans.size() < 8) return {};
  const auto motions = detail::motions_nearby(poses);
  const Mounting mounting = detail::usual_mounting(scans);
  detail::NearestReturns nearest(mounting);
  for (const PointBuffer& scan : scans) nearest.add(scan);
  std::vector<detail::SteadyReturn> candidates, fixed;
  nearest.for_each_direction(
      [&](std::vector<detail::NearestReturns::Return>& returns, double ground) {
        const auto height = [&](const Eigen::Vector3f& p) { return nearest.height_of(p); };
        const auto one = detail::steady_return(returns, scans.size(), height, ground);
        if (!(one.steady > 0.0)) return;
        const bool is_fixed = detail::keeps_its_place(one.point, nearest, motions);
        (is_fixed ? fixed : candidates).push_back(one);
      });
  detail::leave_out_beside(fixed, candidates);
  return {true, detail::reach_of_body(std::move(candidates))};
}

}  // namespace dynains
