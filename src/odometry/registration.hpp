// Registration of a scan to a local map.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "dynains/pose.hpp"
#include "local_map.hpp"

namespace dynains::odometry {

struct Alignment {
  Pose T_map_scan = Pose::Identity();
  double fit = 0.0;         ///< share of the points that lie on a surface
  double score = 0.0;       ///< mean weight of the points, for the choice between alignments
  int free_directions = 0;  ///< of six, that the surfaces do not determine
};

/// Gauss-Newton steps from a predicted pose. `points`: m, frame of the scan. `scale`: m, expected
/// error of the prediction; farther points have little weight at first. `finest`: m, the same for
/// the last steps. Along free directions the motion stays the predicted one.
Alignment align(const std::vector<Eigen::Vector3d>& points, const LocalMap& map,
                const Pose& T_map_predicted, double scale, double finest);

/// The best of alignments from many motions near a pose: up to 3 m along the ground of the sensor,
/// and turns up to 30 deg.
Alignment search(const std::vector<Eigen::Vector3d>& points, const LocalMap& map,
                 const Pose& T_map_near, double finest);

}  // namespace dynains::odometry
