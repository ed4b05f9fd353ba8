// Alignment of a scan with planes: Gauss-Newton steps on point-to-plane distances.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <vector>

#include "dynains/evidence/alignment_points.hpp"
#include "dynains/evidence/correction_support.hpp"
#include "dynains/evidence/normal_equations.hpp"
#include "dynains/evidence/voxel_planes.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"

namespace dynains::detail {

/// Rotates `T` by a small rotation vector (rad) about its own origin, along the axes of the outer
/// frame, and translates it.
inline Pose moved(const Pose& T, const NormalEquations::Vector& step) {
  const double w[3] = {step[3] / 2.0, step[4] / 2.0, step[5] / 2.0};
  const double scale = 1.0 / std::sqrt(1.0 + w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  const double a = scale, b = scale * w[0], c = scale * w[1], d = scale * w[2];
  const double R[3][3] = {
      {1.0 - 2.0 * (c * c + d * d), 2.0 * (b * c - a * d), 2.0 * (b * d + a * c)},
      {2.0 * (b * c + a * d), 1.0 - 2.0 * (b * b + d * d), 2.0 * (c * d - a * b)},
      {2.0 * (b * d - a * c), 2.0 * (c * d + a * b), 1.0 - 2.0 * (b * b + c * c)}};
  Pose result = T;
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
  Pose T_map_sensor = Pose::Identity();  ///< after the supported step
  std::size_t matched = 0;               ///< points in voxels with a plane
  std::size_t inliers = 0;               ///< matched points at a small distance from their plane
  /// Root mean square of the change of the distances between points and planes by the supported
  /// step, m. Unlike the change of the pose, it does not grow in directions without information.
  double change = 0.0;
  CorrectionSupport::Matrix covariance = {};  ///< of `found`, along the axes of the map
  bool is_significant = false;                ///< see CorrectionSupport::Result
  double doubt = 0.0;  ///< length of the translation in `found` that is not supported, m
};

/// Aligns scans with planes.
class PlaneAligner {
 public:
  /// Allocates memory for `count` points.
  void reserve(std::size_t count) { matches_.reserve(count); }

  /// Aligns points with planes, from a first estimate of the pose that is wrong by at most half a
  /// voxel. `prior`: what is presumed about it. Directions without information keep the first
  /// estimate.
  Alignment align(const AlignmentPoints& selected, VoxelPlanes& planes, const Pose& T_guess,
                  CorrectionSupport::Prior prior) {
    const PointsView points = selected.points();
    constexpr double kCoarseScales[] = {0.4, 0.25, 0.15, 0.1};  // m, by iteration
    constexpr double kSmall = 0.01;                             // m, change by one iteration
    constexpr double kScale = 0.06;                             // m
    constexpr int kMostIterations = 3;
    constexpr double kConverged = 0.002;  // m
    Alignment result;
    Pose T = T_guess;
    NormalEquations equations;
    for (const double scale : kCoarseScales) {
      find_planes(points, kCoarseStep, planes, T);
      equations = sum_equations(scale, result.found);
      const NormalEquations::Vector step = equations.solve();
      if (equations.change(step) <= kSmall) break;  // left to the fine steps
      advance(step, T, result.found);
    }
    for (int iteration = 0; iteration < kMostIterations; ++iteration) {
      find_planes(points, 1, planes, T);
      equations = sum_equations(kScale, result.found);
      const NormalEquations::Vector step = equations.solve();
      advance(step, T, result.found);
      if (equations.change(step) <= kConverged) break;
    }
    count_inliers(result);
    collect_support(selected, kScale);
    const CorrectionSupport::Result certain = support_.test(result.found, equations, prior);
    result.supported = certain.step;
    result.is_significant = certain.is_significant;
    result.covariance = certain.covariance;
    result.change = equations.change(result.supported);
    result.doubt =
        std::hypot(result.found[0] - result.supported[0], result.found[1] - result.supported[1],
                   result.found[2] - result.supported[2]);
    result.T_map_sensor = moved(T_guess, result.supported);
    return result;
  }

  /// How well the upright surfaces of a scan fit at a pose: number of points at a small distance
  /// from an upright plane, of which the points of one plane count as at most 8. Points without a
  /// plane do not count. `points`: m, sensor frame.
  double upright_fit(PointsView points, VoxelPlanes& planes, const Pose& T) {
    constexpr double kScale = 0.15;  // m
    find_planes(points, kCoarseStep, planes, T);
    double sum = 0.0;
    weigh_matches(kScale, [&](const Match& match, const auto&, double weight) {
      if (CorrectionSupport::is_upright(match.plane->normal[2])) sum += weight;
    });
    return sum;
  }

 private:
  static constexpr std::size_t kCoarseStep = 3;  // one of so many points
  // Weights of the first estimate. They decide only in directions without information.
  static constexpr NormalEquations::Vector kAttraction = {0.2, 0.2, 0.2, 100.0, 100.0, 100.0};

  struct Match {
    VoxelPlanes::Plane* plane;
    double arm[3];    // from the sensor to the point, m, axes of the map
    double distance;  // m
    std::uint32_t point;
  };

  // Matches every `step`-th point.
  void find_planes(PointsView points, std::size_t step, VoxelPlanes& planes, const Pose& T) {
    using Block = VoxelPlanes::Block;
    matches_.clear();
    for (std::size_t begin = 0; begin < points.size(); begin += Block::kMost * step) {
      const std::size_t end = std::min(points.size(), begin + Block::kMost * step);
      Block block;
      for (std::size_t i = begin; i < end; i += step) {
        block.push_back(T, static_cast<double>(points.x[i]), static_cast<double>(points.y[i]),
                        static_cast<double>(points.z[i]));
      }
      planes.find(block, [&](std::size_t i, VoxelPlanes::Plane& plane) {
        const double(&p)[3] = block.points[i];
        matches_.push_back({&plane,
                            {p[0] - T(0, 3), p[1] - T(1, 3), p[2] - T(2, 3)},
                            plane.distance(p),
                            static_cast<std::uint32_t>(begin + i * step)});
      });
    }
    for (const Match& match : matches_) match.plane->matches = 0;
    for (const Match& match : matches_) ++match.plane->matches;
  }

  // Calls `add(match, derivatives, weight)` for each match. `scale` (m): larger distances have
  // little weight (Geman-McClure). The points of one plane share its error, so that all of them
  // weigh at most as much as kMost points.
  template <class Add>
  void weigh_matches(double scale, Add&& add) const {
    constexpr double kMost = 8.0;
    for (const Match& match : matches_) {
      const double(&n)[3] = match.plane->normal;
      const double(&arm)[3] = match.arm;
      const double loss = scale * scale / (scale * scale + match.distance * match.distance);
      const double most = std::min(kMost, match.plane->points / 3.0);
      const double share = most / (most + static_cast<double>(match.plane->matches));
      add(match,
          NormalEquations::Vector{n[0], n[1], n[2], arm[1] * n[2] - arm[2] * n[1],
                                  arm[2] * n[0] - arm[0] * n[2], arm[0] * n[1] - arm[1] * n[0]},
          loss * loss * share);
    }
  }

  // Equations of the matches for the next step after `found`.
  NormalEquations sum_equations(double scale, const NormalEquations::Vector& found) const {
    NormalEquations equations;
    weigh_matches(scale, [&](const Match& match, const auto& derivatives, double weight) {
      equations.add(derivatives, match.distance, weight);
    });
    for (std::size_t i = 0; i < 6; ++i) equations.attract(i, -found[i], kAttraction[i]);
    return equations;
  }

  // The terms of the last sum, by their witnesses.
  void collect_support(const AlignmentPoints& selected, double scale) {
    const PointsView points = selected.points();
    support_.clear();
    weigh_matches(scale, [&](const Match& match, const auto& derivatives, double weight) {
      const std::size_t i = match.point;
      support_.add({points.x[i], points.y[i], points.z[i], selected.is_on_object(i)}, derivatives,
                   match.distance, weight);
    });
  }

  static void advance(const NormalEquations::Vector& step, Pose& T,
                      NormalEquations::Vector& found) {
    for (std::size_t i = 0; i < 6; ++i) found[i] += step[i];
    T = moved(T, step);
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
