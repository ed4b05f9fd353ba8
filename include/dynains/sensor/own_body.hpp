// Returns from the vehicle or robot that carries the sensor.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "dynains/median.hpp"
#include "dynains/points.hpp"
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
      : mounting_(mounting), by_direction_(kColumns * kRows), ground_(kColumns) {}

  void add(PointsView points) {
    near_.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float x = points.x[i], y = points.y[i];
      if (x * x + y * y < kMaxRange * kMaxRange) near_.push_back(x, y, points.z[i]);
    }
    const BeamAngles angles = beam_angles(near_);
    nearest_.assign(by_direction_.size(), {});
    nearest_ground_.assign(kColumns, std::numeric_limits<float>::infinity());
    for (std::size_t i = 0; i < near_.size(); ++i) {
      const Eigen::Vector3f p(near_.x[i], near_.y[i], near_.z[i]);
      const float range = p.norm();
      if (!(range > 0.0F)) continue;
      const std::size_t column = cell(angles.azimuth[i] + 180.5F, kColumn, kColumns);
      Return& nearest = nearest_[column * kRows + cell(angles.elevation[i] + 90.5F, kRow, kRows)];
      if (range < nearest.range) nearest = {range, p};
      if (height_of(p) < 0.25) {
        nearest_ground_[column] = std::min(nearest_ground_[column], p.head<2>().norm());
      }
    }
    for (std::size_t d = 0; d < nearest_.size(); ++d) {
      if (std::isfinite(nearest_[d].range)) by_direction_[d].push_back(nearest_[d]);
    }
    for (std::size_t c = 0; c < kColumns; ++c) ground_[c].push_back(nearest_ground_[c]);
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
      if (!by_direction_[d].empty()) visit(by_direction_[d], median(ground_[d / kRows]));
    }
  }

 private:
  static constexpr float kColumn = 2.0F;  // deg of azimuth
  static constexpr float kRow = 1.0F;     // deg of elevation
  static constexpr std::size_t kColumns = 181;
  static constexpr std::size_t kRows = 182;

  static std::size_t cell(float angle, float size, std::size_t count) {
    return std::min(static_cast<std::size_t>(angle / size), count - 1);
  }

  Mounting mounting_;
  std::vector<std::vector<Return>> by_direction_;
  std::vector<std::vector<float>> ground_;  // by azimuth, scan by scan
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

/// Largest horizontal distance (m) of the returns of the body: steady ones, and less steady ones
/// next to them, as on dark or slanted metal, or in scans whose motion was compensated.
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
/// sensor moves. `scans`: m, sensor frame, finite points; at least 8 scans of a drive of several
/// metres, with turns if possible. While the sensor stands still, everything near it is taken for
/// the body. The body is assumed to end 4.5 m from the sensor, to be 0.4 m above the
/// ground, and to hide the ground below it. The result is not known for fewer scans. Allocates
/// memory and takes some tens of milliseconds, so call it once, before the first push: a stream
/// cannot know it at its first scan.
inline OwnBody estimate_own_body(const std::vector<PointBuffer>& scans) {
  if (scans.size() < 8) return {};
  const Mounting mounting = detail::usual_mounting(scans);
  detail::NearestReturns nearest(mounting);
  for (const PointBuffer& scan : scans) nearest.add(scan);
  std::vector<detail::SteadyReturn> candidates;
  nearest.for_each_direction(
      [&](std::vector<detail::NearestReturns::Return>& returns, double ground) {
        const auto height = [&](const Eigen::Vector3f& p) { return nearest.height_of(p); };
        const auto one = detail::steady_return(returns, scans.size(), height, ground);
        if (one.steady > 0.0) candidates.push_back(one);
      });
  return {true, detail::reach_of_body(std::move(candidates))};
}

}  // namespace dynains
