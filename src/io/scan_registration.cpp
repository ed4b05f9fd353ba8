#include "scan_registration.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

namespace dynains {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr std::array<double, RegistrationScan::kLevels> kEdges = {4.0, 2.0, 1.0};  // m

VoxelKey key_of(const Eigen::Vector3d& p, double edge) {
  const auto index = [&](double coordinate) {
    const double cell = coordinate / edge;
    const auto number = static_cast<std::int64_t>(cell);
    return number - (static_cast<double>(number) > cell ? 1 : 0);  // floor without a call of libm
  };
  return voxel_key(index(p.x()), index(p.y()), index(p.z()));
}

/// Whether `key` was new to `table`, which has it now.
bool adds(VoxelHashTable<>& table, VoxelKey key) {
  const std::size_t count = table.size();
  return table.insert(key) == count;
}

struct Moments {
  VoxelKey key;
  double count = 0.0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
};

/// Rings of a sensor lie along lines on the ground that move with the sensor, so a line determines
/// a place only if it is upright.
std::optional<RegistrationScan::Cell> cell_of(const Moments& m, double edge) {
  constexpr double kFewest = 6.0;   // points
  constexpr double kThin = 0.15;    // ratio of the extents across and along a plane
  constexpr double kNarrow = 0.2;   // ratio of the extents of a line
  constexpr double kUpright = 0.8;  // z of a pole
  if (m.count < kFewest) return std::nullopt;
  RegistrationScan::Cell cell;
  cell.mean = m.sum / m.count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(m.squares / m.count -
                                                              cell.mean * cell.mean.transpose());
  const Eigen::Vector3d extent = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  const double least_extent = 0.05 * edge;
  if (extent[2] < least_extent) return std::nullopt;
  const Eigen::Matrix3d& axes = solver.eigenvectors();
  if (extent[1] < kNarrow * extent[2]) {
    if (std::abs(axes(2, 2)) < kUpright) return std::nullopt;
    cell.directions = {axes.col(0), axes.col(1)};
    cell.direction_count = 2;
    return cell;
  }
  if (extent[0] > kThin * extent[1] + 0.03) return std::nullopt;
  cell.directions[0] = axes.col(0);
  cell.direction_count = 1;
  return cell;
}

/// Normal equations at one motion.
struct Linearization {
  Matrix6 H = Matrix6::Zero();
  Vector6 g = Vector6::Zero();
  double weight = 0.0;
  std::size_t met = 0;  // points
};

/// `scale`: m, residual at which the weight of a point is a fourth.
Linearization linearize(const RegistrationScan& a, const RegistrationScan& b,
                        const Eigen::Isometry3d& T, std::size_t level, double scale,
                        std::size_t stride) {
  Linearization step;
  auto H = step.H.selfadjointView<Eigen::Lower>();
  for (std::size_t i = 0; i < b.points().size(); i += stride) {
    const Eigen::Vector3d p = T * b.points()[i];
    const RegistrationScan::Cell* const cell = a.find(level, p);
    if (cell == nullptr) continue;
    ++step.met;
    std::array<double, 2> residuals{};
    double squared = 0.0;
    for (std::size_t k = 0; k < cell->direction_count; ++k) {
      residuals[k] = cell->directions[k].dot(p - cell->mean);
      squared += residuals[k] * residuals[k];
    }
    const double root = 1.0 / (1.0 + squared / (scale * scale));
    const double weight = root * root;
    for (std::size_t k = 0; k < cell->direction_count; ++k) {
      Vector6 J;
      J << p.cross(cell->directions[k]), cell->directions[k];
      H.rankUpdate(J, weight);
      step.g += (weight * residuals[k]) * J;
    }
    step.weight += weight;
  }
  step.H.triangularView<Eigen::StrictlyUpper>() = step.H.transpose();
  return step;
}

/// A known component of the translation, as a term of the normal equations.
struct Prior {
  Eigen::Vector3d direction;
  double place;  // m, along direction
  double weight;

  void add_to(Linearization& step, const Eigen::Isometry3d& T) const {
    Vector6 J;
    J << T.translation().cross(direction), direction;
    step.H += weight * J * J.transpose();
    step.g += (weight * (direction.dot(T.translation()) - place)) * J;
  }
};

/// Gauss-Newton steps until they are short.
Eigen::Isometry3d refine(const RegistrationScan& a, const RegistrationScan& b, Eigen::Isometry3d T,
                         std::size_t level, double scale, std::size_t stride, int most,
                         const Prior* prior = nullptr) {
  for (int k = 0; k < most; ++k) {
    Linearization step = linearize(a, b, T, level, scale, stride);
    if (step.met < 30) break;
    if (prior != nullptr) prior->add_to(step, T);
    const Matrix6 damped = step.H + 1e-3 * Matrix6::Identity();
    const Vector6 change = -damped.ldlt().solve(step.g);
    if (!change.allFinite()) break;
    T = motion_of(change) * T;
    if (change.head<3>().norm() < 1e-5 && change.tail<3>().norm() < 1e-4) break;
  }
  return T;
}

}  // namespace

RegistrationScan::RegistrationScan(PointsView points) {
  constexpr double kThinned = 0.4;  // m
  constexpr double kNearest = 2.0, kFarthest = 60.0;
  std::array<VoxelHashTable<>, kLevels> voxels;
  std::array<std::vector<Moments>, kLevels> moments;
  VoxelHashTable<> taken, thinned;
  constexpr std::size_t kMost = 40000;  // points
  const std::size_t stride = 1 + points.size() / kMost;
  for (std::size_t i = 0; i < points.size(); i += stride) {
    const Eigen::Vector3d p(static_cast<double>(points.x[i]), static_cast<double>(points.y[i]),
                            static_cast<double>(points.z[i]));
    const double range = p.norm();
    if (!(range > kNearest && range < kFarthest)) continue;
    // Dense rings would outweigh others: a cell takes one point for each small voxel.
    if (!adds(taken, key_of(p, 0.1))) continue;
    for (std::size_t level = 0; level < kLevels; ++level) {
      const VoxelKey key = key_of(p, kEdges[level]);
      const std::uint32_t number = voxels[level].insert(key);
      if (number == moments[level].size()) moments[level].push_back({key});
      Moments& m = moments[level][number];
      m.count += 1.0;
      m.sum += p;
      m.squares += p * p.transpose();
    }
    if (adds(thinned, key_of(p, kThinned))) points_.push_back(p);
  }
  for (std::size_t level = 0; level < kLevels; ++level) {
    for (const Moments& m : moments[level]) {
      const auto cell = cell_of(m, kEdges[level]);
      if (!cell) continue;
      index_[level].insert(m.key);
      cells_[level].push_back(*cell);
    }
  }
}

const RegistrationScan::Cell* RegistrationScan::find(std::size_t level,
                                                     const Eigen::Vector3d& point) const {
  const std::uint32_t number = index_[level].find(key_of(point, kEdges[level]));
  return number == VoxelHashTable<>::kNone ? nullptr : &cells_[level][number];
}

Eigen::Isometry3d motion_of(const Vector6& rotation_and_translation) {
  const Eigen::Vector3d w = rotation_and_translation.head<3>();
  const double angle = w.norm();
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (angle > 0.0) T.linear() = Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
  T.translation() = rotation_and_translation.tail<3>();
  return T;
}

namespace {

constexpr double kFine = 0.1;  // m
// Residuals of neighbouring points are correlated, so the deviation of a point is a large value.
constexpr double kDeviation = 0.2;  // m

/// Covariance of the translation, for points with a deviation of 1.
Eigen::Matrix3d covariance_of(const Linearization& step) {
  return (step.H + 1e-6 * Matrix6::Identity()).inverse().bottomRightCorner<3, 3>();
}

/// The result at `T` after the last step; empty if too few points meet a cell.
std::optional<Registration> registration_at(const RegistrationScan& a, const RegistrationScan& b,
                                            const Eigen::Isometry3d& T, const Prior* prior) {
  constexpr std::size_t kFewest = 200;  // points that meet a cell
  Linearization step = linearize(a, b, T, 2, kFine, 1);
  if (step.met < kFewest) return std::nullopt;
  Registration result;
  result.T_a_b = T;
  result.score = step.weight / static_cast<double>(step.met);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> by_planes(covariance_of(step));
  result.uncertain = {by_planes.eigenvectors().col(2), by_planes.eigenvectors().col(1)};
  if (prior != nullptr) prior->add_to(step, T);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance_of(step));
  result.uncertainty = kDeviation * std::sqrt(std::max(0.0, solver.eigenvalues()[2]));
  return result;
}

}  // namespace

std::optional<Registration> register_scans(const RegistrationScan& a, const RegistrationScan& b,
                                           const std::vector<Eigen::Isometry3d>& guesses) {
  constexpr double kDistinct = 0.5;  // m
  constexpr double kAlmost = 0.93;   // ratio of scores
  Eigen::Isometry3d best = Eigen::Isometry3d::Identity();
  double best_score = 0.0;
  std::vector<std::pair<Eigen::Vector3d, double>> results;  // translation and score
  for (const Eigen::Isometry3d& guess : guesses) {
    Eigen::Isometry3d T = refine(a, b, guess, 0, 1.0, 4, 12);
    T = refine(a, b, T, 1, 0.4, 3, 10);
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
  best = refine(a, b, best, 2, kFine, 1, 15);
  auto result = registration_at(a, b, best, nullptr);
  if (result) result->is_ambiguous = is_ambiguous;
  return result;
}

std::optional<Registration> register_near(const RegistrationScan& a, const RegistrationScan& b,
                                          const Eigen::Isometry3d& guess, const KnownWay& way) {
  const double ratio = kDeviation / way.deviation;
  const Prior prior{way.direction, way.direction.dot(guess.translation()), ratio * ratio};
  Eigen::Isometry3d T = refine(a, b, guess, 1, 0.2, 1, 8, &prior);
  T = refine(a, b, T, 2, kFine, 1, 15, &prior);
  return registration_at(a, b, T, &prior);
}

}  // namespace dynains
