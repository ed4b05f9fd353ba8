#include "scan_registration.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "given_motion.hpp"

namespace dynains {
namespace {

/// Whether `key` was new to `table`, which has it now.
bool adds(VoxelHashTable<>& table, VoxelKey key) {
  const std::size_t count = table.size();
  return table.insert(key) == count;
}

struct Cell {
  VoxelKey key;
  CellMoments moments;
};

/// The moments of the cell `key`, a new one if `numbers` does not have it.
CellMoments& cell_of(VoxelKey key, VoxelHashTable<>& numbers, std::vector<Cell>& cells) {
  const std::uint32_t number = numbers.insert(key);
  if (number == cells.size()) cells.push_back({key, {}});
  return cells[number].moments;
}

/// Cells of twice the edge.
std::vector<Cell> joined(const std::vector<Cell>& cells) {
  VoxelHashTable<> numbers;
  std::vector<Cell> result;
  for (const Cell& cell : cells) {
    const auto half = [&](int axis) { return voxel_index(cell.key, axis) >> 1; };
    cell_of(voxel_key(half(0), half(1), half(2)), numbers, result).add(cell.moments);
  }
  return result;
}

/// Whether a plane (m, sensor frame) contains the beams that hit it: those of one beam on persons,
/// in foliage or on a rough wall lie in such a plane, which moves with the sensor.
bool is_trace_of_beam(const CellSurface& surface) {
  constexpr double kEdgeOn = 0.04;   // sine of the angle between beam and plane
  constexpr double kDistance = 0.5;  // m, of the plane from the sensor; distant ground is farther
  const double distance = std::abs(surface.directions[0].dot(surface.mean));
  return surface.direction_count == 1 && distance < kDistance &&
         distance < kEdgeOn * surface.mean.norm();
}

/// Normal equations at one motion, and how well it fits.
struct Linearization {
  NormalEquations equations;
  double weight = 0.0;
};

/// `scale`: m, residual at which the weight of a point is a fourth.
Linearization linearize(const RegistrationScan& a, const RegistrationScan& b, const Pose& T,
                        std::size_t level, double scale, std::size_t stride) {
  Linearization result;
  for (std::size_t i = 0; i < b.points().size(); i += stride) {
    const Eigen::Vector3d p = T * b.points()[i];
    const CellSurface* const surface = a.find(level, p);
    if (surface != nullptr) result.weight += result.equations.add(p, *surface, scale).weight;
  }
  return result;
}

/// A known component of the translation, as a term of the normal equations.
struct Prior {
  Eigen::Vector3d direction;
  double place;  // m, along direction
  double weight;

  void add_to(NormalEquations& equations, const Pose& T) const {
    Vector6 J;
    J << T.translation().cross(direction), direction;
    equations.add(J, direction.dot(T.translation()) - place, weight);
  }
};

Pose refine(const RegistrationScan& a, const RegistrationScan& b, const Pose& T, std::size_t level,
            double scale, std::size_t stride, int most, const Prior* prior = nullptr) {
  return gauss_newton(T, most, 1e-5, [&](const Pose& at) {
    Linearization result = linearize(a, b, at, level, scale, stride);
    if (prior != nullptr) prior->add_to(result.equations, at);
    return result.equations;
  });
}

}  // namespace

RegistrationScan::RegistrationScan(PointsView points, double farthest) {
  constexpr double kThinned = 0.4;  // m
  constexpr double kNearest = 2.0;  // m
  constexpr std::size_t kFinest = kCellLevels - 1;
  std::vector<Cell> cells;  // of the finest level
  VoxelHashTable<> numbers, taken, thinned;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p(static_cast<double>(points.x[i]), static_cast<double>(points.y[i]),
                            static_cast<double>(points.z[i]));
    const double range = p.norm();
    if (!(range > kNearest && range < farthest)) continue;
    // Dense rings would outweigh others: a cell takes one point for each small voxel.
    if (!adds(taken, cell_key(p, 0.1))) continue;
    cell_of(cell_key(p, kCellEdges[kFinest]), numbers, cells).add(p);
    if (adds(thinned, cell_key(p, kThinned))) points_.push_back(p);
  }
  for (std::size_t level = kCellLevels; level-- > 0;) {
    if (level < kFinest) cells = joined(cells);
    for (const Cell& cell : cells) {
      const CellSurface surface = surface_of(cell.moments, kCellEdges[level]);
      if (surface.direction_count == 0 || is_trace_of_beam(surface)) continue;
      index_[level].insert(cell.key);
      surfaces_[level].push_back(surface);
    }
  }
}

const CellSurface* RegistrationScan::find(std::size_t level, const Eigen::Vector3d& point) const {
  const std::uint32_t number = index_[level].find(cell_key(point, kCellEdges[level]));
  return number == VoxelHashTable<>::kNone ? nullptr : &surfaces_[level][number];
}

namespace {

constexpr double kFineStep = 0.1;  // m

/// The result at `T` after the last step; empty if too few points meet a cell.
std::optional<Registration> registration_at(const RegistrationScan& a, const RegistrationScan& b,
                                            const Pose& T, const Prior* prior) {
  constexpr std::size_t kFewest = 200;  // points that meet a cell
  Linearization step = linearize(a, b, T, 2, kFineStep, 1);
  if (step.equations.count() < kFewest) return std::nullopt;
  Registration result;
  result.T_a_b = T;
  result.score = step.weight / static_cast<double>(step.equations.count());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> by_planes(
      step.equations.translation_covariance());
  result.uncertain = {by_planes.eigenvectors().col(2), by_planes.eigenvectors().col(1)};
  if (prior != nullptr) prior->add_to(step.equations, T);
  result.uncertainty = step.equations.uncertainty();
  return result;
}

}  // namespace

std::optional<Registration> register_scans(const RegistrationScan& a, const RegistrationScan& b,
                                           const std::vector<Pose>& guesses) {
  constexpr double kDistinct = 0.5;  // m
  constexpr double kSame = 0.1;      // m, at points 10 m away
  constexpr double kAlmost = 0.93;   // ratio of scores
  Pose best = Pose::Identity();
  double best_score = 0.0;
  std::vector<std::pair<Eigen::Vector3d, double>> results;  // translation and score
  std::vector<Pose> starts;
  for (const Pose& guess : guesses) {
    const Pose start = refine(a, b, guess, 0, 1.0, 4, 12);
    // Most guesses lead to one place.
    const bool is_known = std::any_of(starts.begin(), starts.end(), [&](const Pose& other) {
      return extent_of(other.inverse() * start, 10.0) < kSame;
    });
    if (is_known) continue;
    starts.push_back(start);
    const Pose T = refine(a, b, start, 1, 0.4, 3, 10);
    const Linearization step = linearize(a, b, T, 1, 0.3, 2);
    const double score =
        step.weight / (0.5 * static_cast<double>(std::max<std::size_t>(1, b.points().size())));
    results.emplace_back(T.translation(), score);
    if (score <= best_score) continue;
    best = T;
    best_score = score;
  }
  const bool is_ambiguous = std::any_of(results.begin(), results.end(), [&](const auto& result) {
    return (result.first - best.translation()).norm() > kDistinct &&
           result.second > kAlmost * best_score;
  });
  best = refine(a, b, best, 1, 0.2, 1, 8);
  best = refine(a, b, best, 2, kFineStep, 1, 15);
  auto result = registration_at(a, b, best, nullptr);
  if (result) result->is_ambiguous = is_ambiguous;
  return result;
}

std::optional<Registration> register_near(const RegistrationScan& a, const RegistrationScan& b,
                                          const Pose& guess, const KnownTranslation& way) {
  const double ratio = kPointDeviation / way.deviation;
  const Prior prior{way.direction, way.direction.dot(guess.translation()), ratio * ratio};
  Pose T = refine(a, b, guess, 1, 0.2, 1, 8, &prior);
  T = refine(a, b, T, 2, kFineStep, 1, 15, &prior);
  return registration_at(a, b, T, &prior);
}

}  // namespace dynains
