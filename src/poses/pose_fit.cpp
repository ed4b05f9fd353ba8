#include "pose_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "io/median.hpp"

namespace dynains {
namespace {

Vector6 residual(const Pose& body, const Pose& sensor, const Pose& T_body_sensor) {
  return motion_residual(body * T_body_sensor, T_body_sensor * sensor);
}

struct BothMotions {
  Pose body;
  Pose sensor;
};

double robust_cost(const std::vector<BothMotions>& motions, const Pose& T_body_sensor) {
  double cost = 0.0;
  for (const BothMotions& m : motions)
    cost += std::log1p(residual(m.body, m.sensor, T_body_sensor).squaredNorm() / 0.01);
  return cost;
}

/// Gauss-Newton with Cauchy weights and a weak prior that the lever arm is 0.
Pose refine(const std::vector<BothMotions>& motions, Pose T_body_sensor) {
  constexpr double kScale = 0.1;   // m, of a residual
  constexpr double kPrior = 0.02;  // m per m of the lever arm
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 25; ++k) {
    Matrix6 H = 1e-6 * Matrix6::Identity();
    Vector6 g = Vector6::Zero();
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      H(3 + axis, 3 + axis) += kPrior * kPrior;
      g[3 + axis] += kPrior * kPrior * T_body_sensor.translation()[axis];
    }
    for (const BothMotions& m : motions) {
      const Vector6 r = residual(m.body, m.sensor, T_body_sensor);
      Matrix6 J;
      for (Eigen::Index j = 0; j < 6; ++j) {
        Vector6 change = Vector6::Zero();
        change[j] = kStep;
        Pose moved = T_body_sensor;
        const Pose T = motion_of(change);
        moved.linear() = (T.linear() * T_body_sensor.linear()).eval();
        moved.translation() += T.translation();
        J.col(j) = (residual(m.body, m.sensor, moved) - r) / kStep;
      }
      const double weight = 1.0 / (1.0 + r.squaredNorm() / (kScale * kScale));
      H += weight * J.transpose() * J;
      g += weight * J.transpose() * r;
    }
    const Vector6 change = -Eigen::LDLT<Matrix6>(H).solve(g);
    if (!change.allFinite()) break;
    const Pose T = motion_of(change);
    T_body_sensor.linear() = (T.linear() * T_body_sensor.linear()).eval();
    T_body_sensor.translation() += T.translation();
    if (change.norm() < 1e-7) break;
  }
  T_body_sensor.linear() =
      detail::Quaternion(T_body_sensor.linear()).normalized().toRotationMatrix();
  return T_body_sensor;
}

double angle_of(const Eigen::Matrix3d& R) {
  return std::abs(Eigen::AngleAxisd(detail::Quaternion(R)).angle());
}

/// The 24 rotations that map axes to axes.
std::vector<Eigen::Matrix3d> axis_rotations() {
  std::vector<Eigen::Matrix3d> rotations;
  for (int x = 0; x < 3; ++x) {
    for (int y = 0; y < 3; ++y) {
      if (x == y) continue;
      for (const double x_sign : {1.0, -1.0}) {
        for (const double y_sign : {1.0, -1.0}) {
          Eigen::Matrix3d R;
          R.col(0) = x_sign * Eigen::Vector3d::Unit(x);
          R.col(1) = y_sign * Eigen::Vector3d::Unit(y);
          R.col(2) = R.col(0).cross(R.col(1));
          rotations.push_back(R);
        }
      }
    }
  }
  std::stable_sort(rotations.begin(), rotations.end(),
                   [](const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
                     return angle_of(a) < angle_of(b) - 1e-6;
                   });
  return rotations;
}

}  // namespace

namespace {

/// Weights of the axes of residuals, at most 1, from the differences of both registrations.
Vector6 weights_of_axes(const std::vector<RegisteredMotion>& motions) {
  constexpr double kGood = 0.02;  // m
  Vector6 weights;
  for (Eigen::Index axis = 0; axis < 6; ++axis) {
    std::vector<double> differences;
    differences.reserve(motions.size());
    for (const RegisteredMotion& m : motions) differences.push_back(std::abs(m.difference[axis]));
    weights[axis] = kGood / std::max(kGood, median(std::move(differences)));
  }
  return weights;
}

}  // namespace

MotionError motion_error(const std::vector<RegisteredMotion>& motions, const BodyMotion& body,
                         const Pose& T_body_sensor, Motions which) {
  std::vector<double> translations, rotations, translation_noise, rotation_noise, both, noise;
  const Vector6 weights = weights_of_axes(motions);
  for (const RegisteredMotion& motion : motions) {
    const bool is_step = motion.second == motion.first + 1;
    if (which != Motions::kAll && !is_step) continue;
    if (which == Motions::kFirstSteps && motion.second >= kStartScans) continue;
    const auto T_body = body(motion);
    if (!T_body) continue;
    const Vector6 r = residual(*T_body, motion.T_first_second, T_body_sensor);
    const Vector6& d = motion.difference;
    translations.push_back(r.tail<3>().norm());
    rotations.push_back(r.head<3>().norm() / kLever);
    translation_noise.push_back(std::hypot(d.tail<3>().norm(), motion.deviation));
    rotation_noise.push_back(d.head<3>().norm() / kLever);
    both.push_back(r.cwiseProduct(weights).norm());
    noise.push_back(std::hypot(d.cwiseProduct(weights).norm(), motion.deviation));
  }
  MotionError error;
  error.pairs = both.size();
  error.translation = median(std::move(translations));
  error.rotation = median(std::move(rotations));
  error.translation_noise = median(std::move(translation_noise));
  error.rotation_noise = median(std::move(rotation_noise));
  error.at_points = median(std::move(both));
  error.noise = median(std::move(noise));
  return error;
}

bool is_mostly_better(const std::vector<RegisteredMotion>& motions, const BodyMotion& body,
                      const BodyMotion& other) {
  constexpr std::size_t kFewest = 12;
  constexpr double kMost =
      0.7;  // share of the motions; by chance, 17 of 24 are better in 3 % of cases
  const Vector6 weights = weights_of_axes(motions);
  std::size_t better = 0;
  std::size_t count = 0;
  for (const RegisteredMotion& motion : motions) {
    const auto T_body = body(motion);
    const auto T_other = other(motion);
    if (!T_body || !T_other) continue;
    const auto error = [&](const Pose& T) {
      const auto identity = Pose::Identity();
      return residual(T, motion.T_first_second, identity).cwiseProduct(weights).norm();
    };
    if (error(*T_body) < error(*T_other)) ++better;
    ++count;
  }
  return count >= kFewest && static_cast<double>(better) > kMost * static_cast<double>(count);
}

std::optional<Pose> fit_extrinsic(const std::vector<RegisteredMotion>& registered,
                                  const BodyMotion& body) {
  constexpr std::size_t kFewest = 4;
  constexpr double kClearly = 0.9;  // ratio of costs
  std::vector<BothMotions> motions;
  for (const RegisteredMotion& motion : registered) {
    const auto T_body = body(motion);
    if (T_body) motions.push_back({*T_body, motion.T_first_second});
  }
  if (motions.size() < kFewest) return std::nullopt;
  std::optional<Pose> best;
  double least = 0.0;
  for (const Eigen::Matrix3d& R : axis_rotations()) {
    Pose T_body_sensor = Pose::Identity();
    T_body_sensor.linear() = R;
    T_body_sensor = refine(motions, T_body_sensor);
    const double cost = robust_cost(motions, T_body_sensor);
    // The rotations are sorted by their angle: the first of equal results stays.
    if (best && !(cost < kClearly * least)) continue;
    best = T_body_sensor;
    least = cost;
  }
  return best;
}

std::vector<RegisteredMotion> half_of(const std::vector<RegisteredMotion>& motions,
                                      std::size_t which) {
  std::vector<RegisteredMotion> half;
  for (const RegisteredMotion& motion : motions) {
    if (motion.chain % 2 == which) half.push_back(motion);
  }
  return half;
}

}  // namespace dynains
