// Alignment of a scan with planes: Gauss-Newton steps on point-to-plane distances.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <vector>

#include "dynains/evidence/correction_support.hpp"
#include "dynains/evidence/normal_equations.hpp"
#include "dynains/evidence/voxel_planes.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"

namespace dynains::detail {

/// Rotates `T` by a small rotation vector (rad) about its own origin, along the axes of the outer
/// frame, and translates it.
inline Eigen::Isometry3d moved(const Eigen::Isometry3d& T, const NormalEquations::Vector& step) {
  const double w[3] = {step[3] / 2.0, step[4] / 2.0, step[5] / 2.0};
  const double scale = 1.0 / std::sqrt(1.0 + w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  const double a = scale, b = scale * w[0], c = scale * w[1], d = scale * w[2];
  const double R[3][3] = {
      {1.0 - 2.0 * (c * c + d * d), 2.0 * (b * c - a * d), 2.0 * (b * d + a * c)},
      {2.0 * (b * c + a * d), 1.0 - 2.0 * (b * b + d * d), 2.0 * (c * d - a * b)},
      {2.0 * (b * d - a * c), 2.0 * (c * d + a * b), 1.0 - 2.0 * (b * b + c * c)}};
  Eigen::Isometry3d result = T;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      result(i, j) = R[i][0] * T(0, j) + R[i][1] * T(1, j) + R[i][2] * T(2, j);
    }
    result(i, 3) = T(i, 3) + step[static_cast<std::size_t>(i)];
  }
  return result;
}

/// Result of an alignment.
struct Alignment {
  NormalEquations::Vector found = {};  ///< step from the first estimate to the best fit
  /// The part of `found` that is certain, see CorrectionSupport.
  NormalEquations::Vector supported = {};
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();  ///< after the supported step
  std::size_t matched = 0;  ///< points in voxels with a plane
  std::size_t inliers = 0;  ///< matched points at a small distance from their plane
  /// Root mean square of the change of the distances between points and planes by the supported
  /// step, m. Unlike the change of the pose, it does not grow in directions without information.
  double change = 0.0;
};

/// Aligns scans with planes.
class PlaneAligner {
 public:
  /// Allocates memory for `count` points.
  void reserve(std::size_t count) { matches_.reserve(count); }

  /// Aligns points (m, sensor frame) with planes, from a first estimate of the pose that is wrong
  /// by at most half a voxel. Directions without information keep the first estimate.
  Alignment align(PointsView points, VoxelPlanes& planes, const Eigen::Isometry3d& T_guess) {
    constexpr double kCoarseScales[] = {0.4, 0.25, 0.15, 0.1};  // m, by iteration
    constexpr std::size_t kCoarseStep = 3;                      // one of so many points
    constexpr double kSmall = 0.01;                             // m, change by one iteration
    constexpr double kScale = 0.06;                             // m
    constexpr int kMostIterations = 3;
    constexpr double kConverged = 0.002;  // m
    Alignment result;
    Eigen::Isometry3d T = T_guess;
    NormalEquations equations;
    for (const double scale : kCoarseScales) {
      find_planes(points, kCoarseStep, planes, T);
      sum_equations(points, scale, result.found, equations);
      if (advance(equations, T, result.found) <= kSmall) break;
    }
    for (int iteration = 0; iteration < kMostIterations; ++iteration) {
      find_planes(points, 1, planes, T);
      sum_equations(points, kScale, result.found, equations);
      if (advance(equations, T, result.found) <= kConverged) break;
    }
    count_inliers(result);
    result.supported = support_.supported(result.found, equations);
    result.change = equations.change(result.supported);
    result.T_map_sensor = moved(T_guess, result.supported);
    return result;
  }

 private:
  // Weights of the first estimate. They decide only in directions without information.
  static constexpr NormalEquations::Vector kAttraction = {0.2, 0.2, 0.2, 100.0, 100.0, 100.0};

  struct Match {
    VoxelPlanes::Plane* plane;
    double arm[3];    // from the sensor to the point, m, axes of the map
    double distance;  // m
    std::uint32_t point;
  };

  // Matches every `step`-th point.
  void find_planes(PointsView points, std::size_t step, VoxelPlanes& planes,
                   const Eigen::Isometry3d& T) {
    matches_.clear();
    for (std::size_t i = 0; i < points.size(); i += step) {
      Match match;
      double p[3];
      for (int k = 0; k < 3; ++k) {
        match.arm[k] = T(k, 0) * static_cast<double>(points.x[i]) +
                       T(k, 1) * static_cast<double>(points.y[i]) +
                       T(k, 2) * static_cast<double>(points.z[i]);
        p[k] = match.arm[k] + T(k, 3);
      }
      match.plane = planes.find(p);
      if (match.plane == nullptr) continue;
      match.distance = match.plane->distance(p);
      match.point = static_cast<std::uint32_t>(i);
      matches_.push_back(match);
    }
    for (const Match& match : matches_) match.plane->matches = 0;
    for (const Match& match : matches_) ++match.plane->matches;
  }

  // Equations of the matches for the next step after `found`, also by sector in `support_`. `scale`
  // (m): larger distances have little weight (Geman-McClure). The points of one plane share its
  // error, so that all of them weigh at most as much as kMost points.
  void sum_equations(PointsView points, double scale, const NormalEquations::Vector& found,
                     NormalEquations& equations) {
    constexpr double kMost = 20.0;
    support_.clear();
    for (const Match& match : matches_) {
      const double(&n)[3] = match.plane->normal;
      const double(&arm)[3] = match.arm;
      const double loss = scale * scale / (scale * scale + match.distance * match.distance);
      const double share = kMost / (kMost + static_cast<double>(match.plane->matches));
      support_.add(points.x[match.point], points.y[match.point],
                   {n[0], n[1], n[2], arm[1] * n[2] - arm[2] * n[1], arm[2] * n[0] - arm[0] * n[2],
                    arm[0] * n[1] - arm[1] * n[0]},
                   match.distance, loss * loss * share);
    }
    equations = support_.sum();
    for (std::size_t i = 0; i < 6; ++i) equations.attract(i, -found[i], kAttraction[i]);
  }

  // Makes the next step. Returns the root mean square of the change of the distances, m.
  static double advance(const NormalEquations& equations, Eigen::Isometry3d& T,
                        NormalEquations::Vector& found) {
    const NormalEquations::Vector step = equations.solve();
    for (std::size_t i = 0; i < 6; ++i) found[i] += step[i];
    T = moved(T, step);
    return equations.change(step);
  }

  void count_inliers(Alignment& result) const {
    constexpr double kInlier = 0.12;  // m
    result.matched = matches_.size();
    result.inliers = static_cast<std::size_t>(
        std::count_if(matches_.begin(), matches_.end(),
                      [](const Match& match) { return std::abs(match.distance) <= kInlier; }));
  }

  std::vector<Match> matches_;
  CorrectionSupport support_;
};

}  // namespace dynains::detail
