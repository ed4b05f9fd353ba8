#include "dynains/surfaces/scan_registration.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <utility>

namespace dynains {
namespace {

using Points = std::vector<Eigen::Vector3d>;
using Equations = detail::NormalEquations<6>;
using detail::PoseStep;

/// Normal equations at one motion, and how well it fits.
struct Linearization {
  Equations equations;
  double weight = 0.0;         // of all points
  double firm_weight = 0.0;    // of points at planes and poles
  std::size_t firm_count = 0;  // their number

  /// Adds a point that has the `place` (m) at the pose `T`.
  void add(const Pose& T, const Eigen::Vector3d& place, const CellSurface& surface, double scale) {
    const Eigen::Vector3d arm = place - T.translation();
    const double one =
        detail::robust_weight(surface.squared_distance(place) + surface.variance, scale);
    for (std::size_t k = 0; k < surface.direction_count; ++k) {
      const Eigen::Vector3d& n = surface.directions[k];
      const Eigen::Vector3d turn = arm.cross(n);
      equations.add({n[0], n[1], n[2], turn[0], turn[1], turn[2]}, n.dot(place - surface.mean),
                    one);
    }
    weight += one;
    if (surface.variance > 0.0) return;
    firm_weight += one;
    ++firm_count;
  }
  /// Adds what is known otherwise.
  void add(const Pose& T, const std::optional<KnownTranslation>& way) {
    if (!way) return;
    const Eigen::Vector3d& d = way->direction;
    const double ratio = kPointDeviation / way->deviation;
    equations.add({d[0], d[1], d[2], 0.0, 0.0, 0.0}, d.dot(T.translation()) - way->place,
                  ratio * ratio);
  }
};

Linearization linearize(const std::vector<Overlap>& overlaps, const Pose& T, const FitStage& by) {
  Linearization result;
  for (const auto& [a, b] : overlaps) {
    for (std::size_t i = 0; i < b->size(); i += by.stride) {
      const Eigen::Vector3d place = T * (*b)[i];
      const CellSurface* const surface = a->find(by.level, place);
      if (surface != nullptr) result.add(T, place, *surface, by.scale);
    }
  }
  return result;
}

struct Solution {
  PoseStep step = {};       ///< 0 along directions that too little determines
  int free_directions = 0;  ///< their number
  /// Covariance of the translation (m^2), if the distance of each point has a deviation of 1 m.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

/// `a`: its lever and least eigenvalue decide which directions are determined.
Solution solve(const Equations& equations, const SurfaceGrid& a) {
  const auto unit = [&](std::size_t i) { return i < 3 ? 1.0 : 1.0 / a.lever(); };
  Matrix6 hessian;
  Vector6 right;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    right[row] = equations.right()[i] * unit(i);
    for (std::size_t j = 0; j <= i; ++j) {
      const auto column = static_cast<Eigen::Index>(j);
      hessian(row, column) = hessian(column, row) = equations.matrix()[i][j] * unit(i) * unit(j);
    }
  }
  // The singular vectors of a symmetric matrix are its eigenvectors. Eigen's eigenvalue solver is
  // not used, because it aligns its matrices.
  const Eigen::JacobiSVD<Matrix6> solver(hessian, Eigen::ComputeFullU);
  Solution solution;
  for (Eigen::Index k = 0; k < 6; ++k) {
    const Vector6 direction = solver.matrixU().col(k);
    const double value = std::max(solver.singularValues()[k], 1e-6);
    const Eigen::Vector3d way = direction.head<3>();
    solution.covariance += way * way.transpose() / value;
    if (value < a.min_determined()) {
      ++solution.free_directions;
      continue;
    }
    const double size = direction.dot(right) / value;
    for (std::size_t i = 0; i < 6; ++i) {
      solution.step[i] += size * direction[static_cast<Eigen::Index>(i)] * unit(i);
    }
  }
  return solution;
}

constexpr double kFine = 0.1;  // m, scale of weights at the end
constexpr FitStage kLast = {kCellLevels - 1, kFine, 15};

}  // namespace

Pose refined(const std::vector<Overlap>& overlaps, Pose T, const FitStage& by,
             const std::optional<KnownTranslation>& way) {
  constexpr double kShort = 1e-4;  // m
  const SurfaceGrid& a = *overlaps.front().a;
  for (int k = 0; k < by.max_steps; ++k) {
    Linearization result = linearize(overlaps, T, by);
    result.add(T, way);
    const PoseStep step = solve(result.equations, a).step;
    const double length = std::hypot(std::hypot(step[0], step[1], step[2]),
                                     a.lever() * std::hypot(step[3], step[4], step[5]));
    if (!std::isfinite(length)) break;
    T = orthonormalized(detail::moved(T, step));
    if (length < kShort) break;
  }
  return T;
}

double fit_of(const SurfaceGrid& a, const Points& b, const Pose& T_a_b) {
  const Linearization at = linearize({{&a, &b}}, T_a_b, kLast);
  return at.firm_weight / static_cast<double>(std::max<std::size_t>(1, at.firm_count));
}

std::optional<Registration> register_near(const SurfaceGrid& a, const Points& b, const Pose& guess,
                                          const std::optional<KnownTranslation>& way) {
  const std::vector<Overlap> overlap = {{&a, &b}};
  const Pose T = refined(overlap, refined(overlap, guess, {1, 0.2, 8}, way), kLast, way);
  Linearization last = linearize(overlap, T, kLast);
  if (last.firm_count < kMinMatches) return std::nullopt;
  Registration result;
  result.T_a_b = T;
  result.way = way;
  result.score = last.firm_weight / static_cast<double>(last.firm_count);
  const Solution solution = solve(last.equations, a);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> by_planes(solution.covariance);
  result.uncertain = {by_planes.eigenvectors().col(2), by_planes.eigenvectors().col(1)};
  result.free_directions = solution.free_directions;
  last.add(T, way);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> by_all(solve(last.equations, a).covariance);
  result.uncertainty = kPointDeviation * std::sqrt(std::max(0.0, by_all.eigenvalues()[2]));
  return result;
}

RegistrationScan::RegistrationScan(PointsView points, double farthest) {
  VoxelHashTable<> thinned;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p(static_cast<double>(points.x[i]), static_cast<double>(points.y[i]),
                            static_cast<double>(points.z[i]));
    const double range = p.norm();
    if (!(range > kMinPoint && range < farthest)) continue;
    surfaces_.insert(p);
    if (adds(thinned, voxel_at(p, kThinned))) points_.push_back(p);
  }
}

std::optional<Registration> register_scans(const SurfaceGrid& a, const Points& b,
                                           const std::vector<Pose>& guesses) {
  constexpr double kSame = 0.1;  // m, at points kLever away
  const std::vector<Overlap> overlap = {{&a, &b}};
  Pose best = Pose::Identity();
  double best_score = 0.0;
  std::vector<std::pair<Eigen::Vector3d, double>> results;  // translation and score
  std::vector<Pose> starts;
  for (const Pose& guess : guesses) {
    const Pose start = refined(overlap, guess, {0, 1.0, 12, 4});
    // Most guesses lead to one place.
    const bool is_known = std::any_of(starts.begin(), starts.end(), [&](const Pose& other) {
      return extent_of(other.inverse() * start) < kSame;
    });
    if (is_known) continue;
    starts.push_back(start);
    const Pose T = refined(overlap, start, {1, 0.4, 10, 3});
    const double weight = linearize(overlap, T, {1, 0.3, 0, 2}).weight;
    const double score = weight / (0.5 * static_cast<double>(std::max<std::size_t>(1, b.size())));
    results.emplace_back(T.translation(), score);
    if (score <= best_score) continue;
    best = T;
    best_score = score;
  }
  auto result = register_near(a, b, best);
  if (!result) return result;
  result->is_ambiguous = std::any_of(results.begin(), results.end(), [&](const auto& other) {
    return (other.first - best.translation()).norm() > kDistinct &&
           other.second > kAlmost * best_score;
  });
  return result;
}

}  // namespace dynains
