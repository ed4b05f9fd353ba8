// Displacement of two scans along a direction that planes leave open, such as a road.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <optional>
#include <vector>

#include "dynains/pose.hpp"
#include "dynains/surfaces/landmarks.hpp"
#include "dynains/surfaces/scan_registration.hpp"

namespace dynains {

/// Range (m) of landmarks for the search: beside a motorway, near ones may be traffic and rails.
inline constexpr double kWayRange = 80.0;

/// Longest period (s) over which a motion is predicted.
inline constexpr double kMaxPeriod = 1.0;

/// Longest way (m) of a sensor in `period` (s), of which 0.1 to 1 s count: times may be wrong.
inline double longest_way(double period) {
  constexpr double kFastest = 60.0;  // m/s
  return kFastest * std::clamp(period, 0.1, kMaxPeriod);
}

/// Mean distance (m) of the points of each scan from those of the other one, at most 1 m.
double mean_gap(const Landmarks& a, const Landmarks& b, const Pose& T_a_b);

/// Moves `T_a_b` along `direction` (unit vector, frame of a) by less than `farthest` (m) to where
/// plants, posts and signs meet. Points that fit without a motion along `direction` (walls,
/// traffic at the speed of the sensor) are left out. Empty if too few points remain, or if no place
/// is clearly best.
std::optional<Pose> search_way(const Landmarks& a, const Landmarks& b, const Pose& T_a_b,
                               const Eigen::Vector3d& direction, double farthest);

/// Registers the points `b` (m) to the surfaces `a` from where search_way() moves `T_a_b`, and
/// keeps this way. Empty as search_way() and register_near().
std::optional<Registration> register_along(const SurfaceGrid& a,
                                           const std::vector<Eigen::Vector3d>& b,
                                           const Landmarks& landmarks_a,
                                           const Landmarks& landmarks_b, const Pose& T_a_b,
                                           const Eigen::Vector3d& direction, double farthest);

}  // namespace dynains
