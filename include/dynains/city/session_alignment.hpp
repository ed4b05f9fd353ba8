// Where a session lies in the frame of a map of many sessions.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "dynains/pose.hpp"

namespace dynains {

/// Result of SessionAligner; session.json keeps it.
struct SessionAlignment {
  /// The poses of the session are multiplied by it, from the left.
  Pose T_city_session = Pose::Identity();
  /// The estimate that was refined.
  Pose T_city_start = Pose::Identity();
  double residual = 0.0;     ///< m, root mean square distance of the points that fit to the map
  double fitting = 0.0;      ///< [0, 1], share of the points at upright surfaces that fit
  double uncertainty = 0.0;  ///< m, of the translation along its least certain direction
  std::vector<std::string> sessions;  ///< of the map whose points it was aligned to, sorted
};

}  // namespace dynains
