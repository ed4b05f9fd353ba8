// Comparison of poses with the motions that scans themselves show.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "motion_registration.hpp"

namespace dynains {

/// Motion of the body between two scans under some reading of the poses; empty without poses.
using BodyMotion = std::function<std::optional<Pose>(const RegisteredMotion&)>;

/// Difference of poses and registered motions: medians over pairs.
struct MotionError {
  double translation = 0.0;        ///< m
  double rotation = 0.0;           ///< rad
  double translation_noise = 0.0;  ///< m, of the registration
  double rotation_noise = 0.0;     ///< rad, of the registration
  /// m, of both, for points 10 m from the sensor. Axes that the registration determines worse than
  /// others, such as the pitch of a sensor with few beams, count less.
  double at_points = 0.0;
  double noise = 0.0;  ///< m, of the registration, as at_points
  std::size_t pairs = 0;
};

enum class Motions { kAll, kSteps, kFirstSteps };  ///< steps: between neighbouring scans

/// `T_body_sensor`: of the body that moves.
MotionError motion_error(const std::vector<RegisteredMotion>& motions, const BodyMotion& body,
                         const Pose& T_body_sensor, Motions which = Motions::kAll);

/// Whether most motions agree better with `body` than with `other`, each compared with itself:
/// noise of the registration hides small differences of medians. False for fewer than 12 motions
/// with both.
bool is_mostly_better(const std::vector<RegisteredMotion>& motions, const BodyMotion& body,
                      const BodyMotion& other);

/// Hand-eye calibration: T_body_sensor for which the motions of the body and of the sensor agree
/// best. Directions that the motions do not determine stay 0. Empty for fewer than 4 motions.
std::optional<Pose> fit_extrinsic(const std::vector<RegisteredMotion>& registered,
                                  const BodyMotion& body);

/// The motions of even (0) or odd (1) chains.
std::vector<RegisteredMotion> half_of(const std::vector<RegisteredMotion>& motions,
                                      std::size_t which);

}  // namespace dynains
