#include "registration.hpp"

#include <algorithm>
#include <cmath>

#include "dynains/registration/normal_equations.hpp"
#include "symmetric_eigen.hpp"

namespace dynains::odometry {
namespace {

using NormalEquations = detail::NormalEquations<6>;
using Vector = NormalEquations::Vector;

constexpr double kArm = 10.0;  // m, at which a rotation counts as a translation

/// A point of the scan and what it lies on.
struct Match {
  Eigen::Vector3d point;  // m, frame of the scan
  Surface surface;
};

std::vector<Match> match(const std::vector<Eigen::Vector3d>& points, const LocalMap& map,
                         const Pose& T) {
  const Eigen::Vector3d up = T.linear().col(2);
  std::vector<Match> matches;
  for (const Eigen::Vector3d& p : points) {
    Surface surface = map.surface_at(T * p, up);
    if (surface.direction_count > 0) matches.push_back({p, surface});
  }
  return matches;
}

/// m^2, of a point from what it lies on.
double squared_distance(const Match& match, const Pose& T) {
  const Eigen::Vector3d gap = T * match.point - match.surface.mean;
  double squared = 0.0;
  for (std::size_t k = 0; k < match.surface.direction_count; ++k) {
    const double distance = match.surface.directions[k].dot(gap);
    squared += distance * distance;
  }
  return squared;
}

/// Geman-McClure. `squared`: m^2, distance of a point.
double weight_of(double squared, double scale) {
  const double root = 1.0 / (1.0 + squared / (scale * scale));
  return root * root;
}

NormalEquations equations_at(const std::vector<Match>& matches, const Pose& T, double scale) {
  NormalEquations equations;
  for (const Match& match : matches) {
    const Eigen::Vector3d arm = T.linear() * match.point;
    const Eigen::Vector3d gap = arm + T.translation() - match.surface.mean;
    const double weight = weight_of(squared_distance(match, T) + match.surface.variance, scale);
    for (std::size_t k = 0; k < match.surface.direction_count; ++k) {
      const Eigen::Vector3d& n = match.surface.directions[k];
      const Eigen::Vector3d turn = arm.cross(n) / kArm;
      equations.add({n.x(), n.y(), n.z(), turn.x(), turn.y(), turn.z()}, n.dot(gap), weight);
    }
  }
  return equations;
}

/// Step and number of directions that were left out because too little determines them.
struct Step {
  Vector step = {};
  int free_directions = 0;
};

Step solve(const NormalEquations& equations) {
  constexpr double kFewest = 8.0;  // weight, in points whose distance changes as much as the motion
  detail::SymmetricEigen<6>::Matrix matrix = {};
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) {
      matrix[i][j] = equations.matrix()[std::max(i, j)][std::min(i, j)];
    }
  }
  const Vector right = equations.right();
  const auto eigen = detail::symmetric_eigen<6>(matrix);
  Step result;
  for (std::size_t k = 0; k < 6; ++k) {
    if (eigen.values[k] < kFewest) {
      ++result.free_directions;
      continue;
    }
    double along = 0.0;
    for (std::size_t i = 0; i < 6; ++i) along += eigen.vectors[k][i] * right[i];
    for (std::size_t i = 0; i < 6; ++i) {
      result.step[i] += eigen.vectors[k][i] * along / eigen.values[k];
    }
  }
  return result;
}

Pose moved(const Pose& T, const Vector& step) {
  const Eigen::Vector3d turn(step[3] / kArm, step[4] / kArm, step[5] / kArm);
  Pose result = T;
  result.translation() += Eigen::Vector3d(step[0], step[1], step[2]);
  result.linear() =
      Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()).toRotationMatrix() * T.linear();
  return orthonormalized(result);
}

double length_of(const Vector& step) {
  double squared = 0.0;
  for (const double value : step) squared += value * value;
  return std::sqrt(squared);
}

/// Fills in how well the points fit.
void rate(const std::vector<Match>& matches, std::size_t points, double scale,
          Alignment& alignment) {
  constexpr double kNear = 0.2;  // m
  std::size_t near = 0;
  double weights = 0.0;
  for (const Match& match : matches) {
    const double squared = squared_distance(match, alignment.T_map_scan);
    if (squared < kNear * kNear) ++near;
    weights += weight_of(squared, scale);
  }
  const double count = static_cast<double>(std::max<std::size_t>(1, points));
  alignment.fit = static_cast<double>(near) / count;
  alignment.score = weights / count;
}

}  // namespace

Alignment align(const std::vector<Eigen::Vector3d>& points, const LocalMap& map,
                const Pose& T_map_predicted, double scale, double finest) {
  constexpr int kMostMatchings = 12, kStepsOfMatching = 2;
  constexpr double kConverged = 3e-3, kExact = 1e-4;  // m
  Alignment result;
  result.T_map_scan = T_map_predicted;
  std::vector<Match> matches;
  scale = std::max(scale, finest);
  for (int k = 0; k < kMostMatchings; ++k) {
    matches = match(points, map, result.T_map_scan);
    double longest = 0.0;
    for (int i = 0; i < kStepsOfMatching; ++i) {
      const Step step = solve(equations_at(matches, result.T_map_scan, scale));
      result.free_directions = step.free_directions;
      result.T_map_scan = moved(result.T_map_scan, step.step);
      longest = std::max(longest, length_of(step.step));
      if (longest < kExact) break;
    }
    if (longest < kConverged && scale <= finest) break;
    scale = std::max(finest, 0.6 * scale);
  }
  rate(matches, points.size(), finest, result);
  return result;
}

Alignment search(const std::vector<Eigen::Vector3d>& points, const LocalMap& map,
                 const Pose& T_map_near, double finest) {
  constexpr std::size_t kStride = 3;  // of the points that choose
  constexpr double kScale = 0.5;      // m
  constexpr int kDirections = 8, kRings = 3;
  std::vector<Eigen::Vector3d> few;
  for (std::size_t i = 0; i < points.size(); i += kStride) few.push_back(points[i]);
  Alignment best = align(few, map, T_map_near, kScale, finest);
  const auto attempt = [&](const Pose& T_near_guess) {
    const Alignment found = align(few, map, T_map_near * T_near_guess, kScale, finest);
    if (found.score > best.score) best = found;
  };
  for (int ring = 1; ring <= kRings; ++ring) {  // its radius in m
    for (int i = 0; i < kDirections; ++i) {
      const double angle = 2.0 * M_PI * i / kDirections;
      Pose guess = Pose::Identity();
      guess.translation() = ring * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
      attempt(guess);
    }
  }
  for (const double degrees : {-30.0, -20.0, -10.0, 10.0, 20.0, 30.0}) {
    Pose guess = Pose::Identity();
    guess.linear() =
        Eigen::AngleAxisd(degrees * M_PI / 180.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    attempt(guess);
  }
  return align(points, map, best.T_map_scan, finest, finest);
}

}  // namespace dynains::odometry
