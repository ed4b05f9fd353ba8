#include "scan_registration.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "given_motion.hpp"

namespace dynains {
namespace {

using Points = std::vector<Eigen::Vector3d>;

/// Normal equations at one motion, and how well it fits.
struct Linearization {
  explicit Linearization(const SurfaceGrid& grid) : equations(grid) {}
  NormalEquations equations;
  double weight = 0.0;         // of all points
  double firm_weight = 0.0;    // of points at planes and poles
  std::size_t firm_count = 0;  // their number
};

/// `scale`: m, residual at which the weight of a point is a fourth.
Linearization linearize(const SurfaceGrid& a, const Points& b, const Pose& T, std::size_t level,
                        double scale, std::size_t stride) {
  Linearization result(a);
  for (std::size_t i = 0; i < b.size(); i += stride) {
    const CellSurface* const surface = a.find(level, T * b[i]);
    if (surface == nullptr) continue;
    const double weight = result.equations.add(T, b[i], *surface, scale);
    result.weight += weight;
    if (surface->variance > 0.0) continue;
    result.firm_weight += weight;
    ++result.firm_count;
  }
  return result;
}

/// Gauss-Newton steps from `T`, at most `most`, until they are short.
Pose refine(const SurfaceGrid& a, const Points& b, Pose T, std::size_t level, double scale,
            std::size_t stride, int most, const std::optional<KnownTranslation>& way = {}) {
  constexpr double kShort = 1e-4;  // m
  for (int k = 0; k < most; ++k) {
    Linearization result = linearize(a, b, T, level, scale, stride);
    if (way) way->add_to(result.equations, T);
    const Vector6 step = result.equations.solve().step;
    if (!step.allFinite()) break;
    T = stepped(T, step, a.lever());
    if (step.norm() < kShort) break;
  }
  return T;
}

constexpr double kFine = 0.1;  // m, scale of weights at the end

}  // namespace

double fit_of(const SurfaceGrid& a, const Points& b, const Pose& T_a_b) {
  const Linearization at = linearize(a, b, T_a_b, kCellLevels - 1, kFine, 1);
  return at.firm_weight / static_cast<double>(std::max<std::size_t>(1, at.firm_count));
}

void KnownTranslation::add_to(NormalEquations& equations, const Pose& T) const {
  const double ratio = kPointDeviation / deviation;
  Vector6 J;
  J << direction, Eigen::Vector3d::Zero();
  equations.add(J, direction.dot(T.translation()) - place, ratio * ratio);
}

std::optional<Registration> register_near(const SurfaceGrid& a, const Points& b, const Pose& guess,
                                          const std::optional<KnownTranslation>& way) {
  Pose T = refine(a, b, guess, 1, 0.2, 1, 8, way);
  T = refine(a, b, T, 2, kFine, 1, 15, way);
  Linearization last = linearize(a, b, T, 2, kFine, 1);
  if (last.firm_count < kMinMatches) return std::nullopt;
  Registration result;
  result.T_a_b = T;
  result.way = way;
  result.score = last.firm_weight / static_cast<double>(last.firm_count);
  const auto solution = last.equations.solve();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> by_planes(solution.covariance);
  result.uncertain = {by_planes.eigenvectors().col(2), by_planes.eigenvectors().col(1)};
  result.free_directions = solution.free_directions;
  if (way) way->add_to(last.equations, T);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> by_all(last.equations.solve().covariance);
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
  Pose best = Pose::Identity();
  double best_score = 0.0;
  std::vector<std::pair<Eigen::Vector3d, double>> results;  // translation and score
  std::vector<Pose> starts;
  for (const Pose& guess : guesses) {
    const Pose start = refine(a, b, guess, 0, 1.0, 4, 12);
    // Most guesses lead to one place.
    const bool is_known = std::any_of(starts.begin(), starts.end(), [&](const Pose& other) {
      return extent_of(other.inverse() * start) < kSame;
    });
    if (is_known) continue;
    starts.push_back(start);
    const Pose T = refine(a, b, start, 1, 0.4, 3, 10);
    const double weight = linearize(a, b, T, 1, 0.3, 2).weight;
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
