#include "scan_registration.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "dynains/stage/voxel_hash_table.hpp"

namespace dynains {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr std::array<double, RegistrationScan::kLevels> kEdges = {4.0, 2.0, 1.0};  // m

VoxelKey key_of(const Eigen::Vector3d& p, double edge) {
  const auto index = [&](double coordinate) {
    return static_cast<std::int64_t>(std::floor(coordinate / edge));
  };
  return voxel_key(index(p.x()), index(p.y()), index(p.z()));
}

struct Moments {
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
    cell.constraint = Eigen::Matrix3d::Identity() - axes.col(2) * axes.col(2).transpose();
    return cell;
  }
  if (extent[0] > kThin * extent[1] + 0.03) return std::nullopt;
  cell.constraint = axes.col(0) * axes.col(0).transpose();
  return cell;
}

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
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
  for (std::size_t i = 0; i < b.points().size(); i += stride) {
    const Eigen::Vector3d p = T * b.points()[i];
    const RegistrationScan::Cell* const cell = a.find(level, p);
    if (cell == nullptr) continue;
    ++step.met;
    const Eigen::Vector3d r = cell->constraint * (p - cell->mean);
    const double root = 1.0 / (1.0 + r.squaredNorm() / (scale * scale));
    const double weight = root * root;
    Eigen::Matrix<double, 3, 6> J;
    J << -skew(p), Eigen::Matrix3d::Identity();
    J = (cell->constraint * J).eval();
    step.H += weight * J.transpose() * J;
    step.g += weight * J.transpose() * r;
    step.weight += weight;
  }
  return step;
}

/// Gauss-Newton steps until they are short.
Eigen::Isometry3d refine(const RegistrationScan& a, const RegistrationScan& b, Eigen::Isometry3d T,
                         std::size_t level, double scale, std::size_t stride, int most) {
  for (int k = 0; k < most; ++k) {
    const Linearization step = linearize(a, b, T, level, scale, stride);
    if (step.met < 30) break;
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
  std::array<std::unordered_map<std::uint64_t, Moments>, kLevels> moments;
  std::unordered_map<std::uint64_t, bool> taken;
  constexpr std::size_t kMost = 40000;  // points
  const std::size_t stride = 1 + points.size() / kMost;
  for (std::size_t i = 0; i < points.size(); i += stride) {
    const Eigen::Vector3d p(static_cast<double>(points.x[i]), static_cast<double>(points.y[i]),
                            static_cast<double>(points.z[i]));
    const double range = p.norm();
    if (!(range > kNearest && range < kFarthest)) continue;
    // Dense rings would outweigh others: a cell takes one point for each small voxel.
    if (!taken.emplace(key_of(p, 0.1), true).second) continue;
    for (std::size_t level = 0; level < kLevels; ++level) {
      Moments& m = moments[level][key_of(p, kEdges[level])];
      m.count += 1.0;
      m.sum += p;
      m.squares += p * p.transpose();
    }
    if (taken.emplace(key_of(p, kThinned) | std::uint64_t{1} << 63U, true).second) {
      points_.push_back(p);
    }
  }
  for (std::size_t level = 0; level < kLevels; ++level) {
    for (const auto& [key, m] : moments[level]) {
      if (const auto cell = cell_of(m, kEdges[level])) cells_[level].emplace(key, *cell);
    }
  }
}

const RegistrationScan::Cell* RegistrationScan::find(std::size_t level,
                                                     const Eigen::Vector3d& point) const {
  const auto found = cells_[level].find(key_of(point, kEdges[level]));
  return found == cells_[level].end() ? nullptr : &found->second;
}

Eigen::Isometry3d motion_of(const Vector6& rotation_and_translation) {
  const Eigen::Vector3d w = rotation_and_translation.head<3>();
  const double angle = w.norm();
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (angle > 0.0) T.linear() = Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
  T.translation() = rotation_and_translation.tail<3>();
  return T;
}

std::optional<Registration> register_scans(const RegistrationScan& a, const RegistrationScan& b,
                                           const std::vector<Eigen::Isometry3d>& guesses) {
  constexpr std::size_t kFewest = 200;  // points that meet a cell
  constexpr double kFine = 0.1;         // m
  constexpr double kDistinct = 0.5;     // m
  constexpr double kAlmost = 0.93;      // ratio of scores
  Registration best;
  std::vector<std::pair<Eigen::Vector3d, double>> results;  // translation and score
  for (const Eigen::Isometry3d& guess : guesses) {
    Eigen::Isometry3d T = refine(a, b, guess, 0, 1.0, 4, 12);
    T = refine(a, b, T, 1, 0.4, 3, 10);
    const Linearization step = linearize(a, b, T, 1, 0.3, 2);
    const double score =
        step.weight / (0.5 * static_cast<double>(std::max<std::size_t>(1, b.points().size())));
    results.emplace_back(T.translation(), score);
    if (score > best.score) best = {T, score, 0.0};
  }
  for (const auto& [translation, score] : results) {
    const bool is_other = (translation - best.T_a_b.translation()).norm() > kDistinct;
    if (is_other && score > kAlmost * best.score) return std::nullopt;
  }
  best.T_a_b = refine(a, b, best.T_a_b, 1, 0.2, 1, 8);
  best.T_a_b = refine(a, b, best.T_a_b, 2, kFine, 1, 15);
  const Linearization step = linearize(a, b, best.T_a_b, 2, kFine, 1);
  if (step.met < kFewest) return std::nullopt;
  best.score = step.weight / static_cast<double>(step.met);
  // Residuals of neighbouring points are correlated, so the deviation of a point is a large value.
  constexpr double kDeviation = 0.2;  // m
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(
      (step.H + 1e-6 * Matrix6::Identity()).inverse().bottomRightCorner<3, 3>());
  best.uncertainty = kDeviation * std::sqrt(std::max(0.0, solver.eigenvalues()[2]));
  return best;
}

}  // namespace dynains
