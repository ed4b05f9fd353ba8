// Alignment of a scan with planes: Gauss-Newton steps on point-to-plane distances (Chen and
// Medioni, Image Vision Comput. 10(3), 1992).
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/registration/normal_equations.hpp"
#include "dynains/registration/voxel_planes.hpp"
#include "dynains/simd/pack_loops.hpp"

namespace dynains::detail {

/// Calls `visit(index, x, y, z)` for at most `wanted` points of a scan, 3 to 50 m from the sensor.
/// They are spread evenly over its order, at pseudo-random distances, since beams repeat at regular
/// ones.
template <class Visit>
void visit_some(const GroundSplit& split, std::size_t wanted, Visit&& visit) {
  constexpr double kMinRange = 3.0, kMaxRange = 50.0;  // m, horizontal
  const std::size_t step = split.count / wanted + 1;
  std::uint32_t random = 1;
  for (std::size_t begin = 0; begin < split.count; begin += step) {
    random = random * 1664525U + 1013904223U;
    const std::size_t i = step == 1 ? begin : begin + (random >> 8) % step;  // division is slow
    if (i >= split.count) return;
    const double x = static_cast<double>(split.points.x[i]);
    const double y = static_cast<double>(split.points.y[i]);
    const double squared = x * x + y * y;
    if (squared < kMinRange * kMinRange || squared > kMaxRange * kMaxRange) continue;
    visit(i, x, y, static_cast<double>(split.points.z[i]));
  }
}

/// At most 3,000 points of a scan for an alignment, m, sensor frame.
inline void select_points(const GroundSplit& split, PointBuffer& points) {
  constexpr std::size_t kSelected = 3000;
  points.resize(kSelected);
  std::size_t count = 0;
  visit_some(split, kSelected,
             [&](std::size_t i, double, double, double) { points.set(count++, split.points, i); });
  points.resize(count);
}

/// Result of an alignment.
struct Alignment {
  PoseStep found = {};      ///< step from the first estimate to the best fit
  PoseStep supported = {};  ///< the part of `found` that is certain; none if the pose may be exact
  std::size_t matched = 0;  ///< points in voxels with a plane
  std::size_t inliers = 0;  ///< matched points at a small distance from their plane
  /// Root mean square of the change of the distances between points and planes by the supported
  /// step, m. Unlike the change of the pose, it does not grow in directions without information.
  double change = 0.0;
  PoseCovariance covariance = {};  ///< of `found`, along the axes of the map
};

/// Aligns scans with planes. Errors of the sensor are unknowns beside the pose, so that they are
/// not taken for errors of the pose: the error of all elevations is estimated from scan to scan,
/// that of the mounting may explain what is wrong with poses that are presumed to be exact.
///
/// The covariance of a step has a part for the noise of the distances and a part for the choice of
/// surfaces: a jackknife over overlapping blocks (Kuensch, Ann. Stat. 17(3), 1989), the changes of
/// the step without two adjacent sectors around the sensor. The latter is large if one object
/// decides about a direction, for example a slow vehicle ahead.
class PlaneAligner {
 public:
  /// Forgets the errors of the sensor.
  void clear() {
    elevation_ = 0.0;
    elevation_weight_ = kMinWeight;
  }

  /// Aligns points with planes, from a first estimate of the pose that is wrong by at most half a
  /// voxel. `is_exact`: whether the pose is presumed to be exact. Directions without information
  /// keep the first estimate.
  Alignment align(PointsView points, VoxelPlanes& planes, const Pose& T_guess, bool is_exact) {
    constexpr double kCoarseScales[] = {0.4, 0.25, 0.15, 0.1};  // edges, by iteration
    constexpr double kSmall = 0.01;                             // m, change by one iteration
    const double fine = 0.06 * planes.edge();                   // m
    constexpr int kMaxIterations = 3;
    constexpr double kConverged = 0.002;  // m
    Vector found = {};
    Pose T = T_guess;
    Equations equations;
    const auto advance = [&](const Vector& step) {
      for (std::size_t i = 0; i < kUnknowns; ++i) found[i] += step[i];
      T = moved(T, pose_step(step));
      return equations.change(pose_step(step));
    };
    for (const double scale : kCoarseScales) {
      find_planes(points, kCoarseStep, planes, T, found);
      equations = sum_equations(scale * planes.edge(), found, is_exact);
      const Vector step = equations.solve();
      if (equations.change(pose_step(step)) <= kSmall) break;  // left to the fine steps
      advance(step);
    }
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      find_planes(points, 1, planes, T, found);
      equations = sum_equations(fine, found, is_exact);
      if (advance(equations.solve()) <= kConverged) break;
    }
    return result_of(points, equations, found, is_exact, fine);
  }

  /// How well the upright surfaces of a scan fit at a pose: number of points at a small distance
  /// from an upright plane, of which the points of one plane count as at most 8. Points without a
  /// plane do not count. `points`: m, sensor frame.
  double upright_fit(PointsView points, VoxelPlanes& planes, const Pose& T) {
    constexpr double kScale = 0.15;  // m
    find_planes(points, kCoarseStep, planes, T, {});
    double sum = 0.0;
    weigh_matches(kScale, [&](const Match& match, const auto&, double weight) {
      if (std::abs(match.plane->normal[2]) < kUpright) sum += weight;
    });
    return sum;
  }

 private:
  static constexpr std::size_t kUnknowns = 6 + kSensorErrors;
  using Equations = NormalEquations<kUnknowns>;
  using Vector = Equations::Vector;

  static constexpr std::size_t kCoarseStep = 3;  // one of so many points
  static constexpr double kUpright = 0.7;        // most z of the unit normal of a wall
  // Weights of the first estimate. They decide only in directions without information.
  static constexpr PoseStep kAttraction = {0.2, 0.2, 0.2, 100.0, 100.0, 100.0};
  static constexpr double kMinWeight = 8.0;   // of errors of the sensor: 0.4 deg, at 2 cm
  static constexpr double kNone = 1e9;        // weight of an unknown that stays
  static constexpr double kMemory = 0.97;     // of the weight of the elevation, by scan
  static constexpr double kDeviations = 4.0;  // of a step that is half certain
  static constexpr double kOfExact = 8.0;     // of one that shows that the pose is not exact

  struct Match {
    VoxelPlanes::Plane* plane;
    double arm[3];  // from the sensor to the point, m, axes of the map
    std::array<double, kSensorErrors> errors;
    double distance;  // m
    std::uint32_t point;
  };

  static PoseStep pose_step(const Vector& step) {
    return {step[0], step[1], step[2], step[3], step[4], step[5]};
  }

  // Matches every `step`-th point.
  void find_planes(PointsView points, std::size_t step, VoxelPlanes& planes, const Pose& T,
                   const Vector& found) {
    matches_.clear();
    // AVX2 processors add four numbers at a time, here and below.
    with_packs([&](auto) {
      VoxelPlanes::Block block;
      for (std::size_t begin = 0; begin < points.size(); begin += block.x.size() * step) {
        block.count = 0;
        match_block(points, begin, step, planes, T, found, block);
      }
    });
    for (const Match& match : matches_) match.plane->matches = 0;
    for (const Match& match : matches_) ++match.plane->matches;
  }

  // Matches every `step`-th point from index `begin` on, as many as a block holds.
  void match_block(PointsView points, std::size_t begin, std::size_t step, VoxelPlanes& planes,
                   const Pose& T, const Vector& found, VoxelPlanes::Block& block) {
    for (std::size_t i = begin; i < points.size() && !block.is_full(); i += step) {
      block.push_back(static_cast<double>(points.x[i]), static_cast<double>(points.y[i]),
                      static_cast<double>(points.z[i]));
    }
    planes.find(T, block, [&](std::size_t i, VoxelPlanes::Plane& plane, const auto& placed) {
      const std::array<double, 3> p = placed.point(i);
      Match match = {&plane,
                     {p[0] - T(0, 3), p[1] - T(1, 3), p[2] - T(2, 3)},
                     {},
                     plane.distance(p),
                     static_cast<std::uint32_t>(begin + i * step)};
      for (std::size_t k = 0; k < kSensorErrors; ++k) {
        match.errors[k] = -plane.moved[k];
        for (std::size_t axis = 0; axis < 3; ++axis) {
          match.errors[k] += plane.normal[axis] * static_cast<double>(placed.moved[k][axis][i]);
        }
        match.distance += match.errors[k] * ((k == 0 ? elevation_ : 0.0) + found[6 + k]);
      }
      matches_.push_back(match);
    });
  }

  // Calls `add(match, derivatives, weight)` for each match. `scale`: m, of robust_weight(). The
  // points of one plane share its error, so that all of them weigh at most as much as kMaxCount
  // points.
  template <class Add>
  void weigh_matches(double scale, Add&& add) const {
    constexpr double kMaxCount = 8.0;
    for (const Match& match : matches_) {
      const double(&n)[3] = match.plane->normal;
      const double(&arm)[3] = match.arm;
      const double share = kMaxCount / (kMaxCount + static_cast<double>(match.plane->matches));
      add(match,
          Vector{n[0], n[1], n[2], arm[1] * n[2] - arm[2] * n[1], arm[2] * n[0] - arm[0] * n[2],
                 arm[0] * n[1] - arm[1] * n[0], match.errors[0], match.errors[1], match.errors[2]},
          robust_weight(match.distance * match.distance, scale) * share);
    }
  }

  // Equations of the matches for the next step after `found`.
  Equations sum_equations(double scale, const Vector& found, bool is_exact) const {
    Equations equations;
    with_packs([&](auto) {
      weigh_matches(scale, [&](const Match& match, const Vector& derivatives, double weight) {
        equations.add(derivatives, match.distance, weight);
      });
    });
    for (std::size_t i = 0; i < 6; ++i) equations.attract(i, -found[i], kAttraction[i]);
    equations.attract(6, -found[6], elevation_weight_);
    for (std::size_t i = 7; i < kUnknowns; ++i) {
      equations.attract(i, -found[i], is_exact ? kMinWeight : kNone);
    }
    return equations;
  }

  Alignment result_of(PointsView points, const Equations& equations, const Vector& found,
                      bool is_exact, double scale) {
    constexpr double kInlier = 0.12;  // m
    Alignment result;
    result.found = pose_step(found);
    result.matched = matches_.size();
    result.inliers = static_cast<std::size_t>(
        std::count_if(matches_.begin(), matches_.end(),
                      [](const Match& match) { return std::abs(match.distance) <= kInlier; }));
    const Equations::Matrix inverse = equations.inverse();
    elevation_ += found[6];
    elevation_weight_ = std::max(kMinWeight, kMemory / inverse[6][6]);
    result.covariance = covariance_of(points, equations, inverse, scale);
    if (!is_exact || is_certain(result.found, result.covariance)) {
      result.supported = supported_part(result.found, result.covariance);
    }
    result.change = equations.change(result.supported);
    add_first_error(inverse, result.covariance);
    return result;
  }

  // Whether a step is too large for its covariance to be an error of the alignment.
  static bool is_certain(const PoseStep& found, const PoseCovariance& covariance) {
    const PoseStep weighted = solve_symmetric<6>(covariance, found);
    double squared = 0.0;
    for (std::size_t i = 0; i < 6; ++i) squared += found[i] * weighted[i];
    return squared >= kOfExact * kOfExact;
  }

  // The update of a Kalman filter (Kalman 1960) from a zero prior: the covariance of the prior has
  // a standard deviation of a quarter of the step along each axis, `covariance` is that of the
  // measurement.
  static PoseStep supported_part(const PoseStep& found, const PoseCovariance& covariance) {
    PoseStep variances;
    PoseCovariance sum = covariance;
    for (std::size_t i = 0; i < 6; ++i) {
      variances[i] = found[i] * found[i] / (kDeviations * kDeviations);
      sum[i][i] += variances[i];
    }
    PoseStep result = solve_symmetric<6>(sum, found);
    for (std::size_t i = 0; i < 6; ++i) result[i] *= variances[i];
    return result;
  }

  // Sectors of nearly equal angles, without trigonometric functions.
  static std::size_t sector_of(float x, float y) {
    const double length = std::abs(static_cast<double>(x)) + std::abs(static_cast<double>(y));
    if (!(length > 0.0)) return 0;
    const double t = static_cast<double>(y) / length;
    const double angle = x >= 0.0F ? 1.0 + t : 3.0 - t;  // [0, 4]
    return std::min(static_cast<std::size_t>(angle * (kSectors / 4.0)), kSectors - 1);
  }

  PoseCovariance covariance_of(PointsView points, const Equations& equations,
                               const Equations::Matrix& inverse, double scale) {
    PoseCovariance covariance;
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < 6; ++j) covariance[i][j] = equations.variance() * inverse[i][j];
    }
    add_changes(points, equations, scale, covariance);
    return covariance;
  }

  // Adds the squared changes of the solution without each pair of adjacent sectors: of pairs, so
  // that no object is divided.
  void add_changes(PointsView points, const Equations& equations, double scale,
                   PoseCovariance& covariance) {
    std::array<Equations, kSectors> sectors;
    with_packs([&](auto) {
      weigh_matches(scale, [&](const Match& match, const Vector& derivatives, double weight) {
        const std::size_t i = match.point;
        sectors[sector_of(points.x[i], points.y[i])].add(derivatives, match.distance, weight);
      });
    });
    const Vector all = equations.solve();
    for (std::size_t sector = 0; sector < kSectors; ++sector) {
      Equations others = equations;
      others -= sectors[sector];
      others -= sectors[(sector + 1) % kSectors];
      Vector change = others.solve();
      for (std::size_t i = 0; i < 6; ++i) change[i] -= all[i];
      for (std::size_t i = 0; i < 6; ++i) {
        for (std::size_t j = 0; j < 6; ++j) covariance[i][j] += change[i] * change[j] / 2.0;
      }
    }
  }

  // In directions that the surfaces do not determine, attractions keep the first estimate and its
  // error, a standard deviation of 1 m.
  static void add_first_error(const Equations::Matrix& inverse, PoseCovariance& covariance) {
    for (std::size_t k = 0; k < 6; ++k) {
      const double kept = kAttraction[k] / (k < 3 ? 1.0 : kLever);
      for (std::size_t i = 0; i < 6; ++i) {
        for (std::size_t j = 0; j < 6; ++j) {
          covariance[i][j] += kept * kept * inverse[i][k] * inverse[j][k];
        }
      }
    }
  }

  static constexpr std::size_t kSectors = 32;

  std::vector<Match> matches_;
  double elevation_ = 0.0;  // rad, error of all elevations
  double elevation_weight_ = kMinWeight;
};

}  // namespace dynains::detail
