// Comparison of poses with the motions that scans themselves show.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"

namespace dynains {

/// Motion of the sensor between two scans, by their registration.
struct RegisteredMotion {
  std::size_t chain;   ///< motions of one chain begin at one scan
  std::size_t first;   ///< scan
  std::size_t second;  ///< scan
  Pose T_first_second;
  /// Difference of both directions of the registration: rotation times 10 m, and translation, m.
  Eigen::Matrix<double, 6, 1, Eigen::DontAlign> difference;
  double deviation;  ///< m, of a direction that landmarks determine; 0: none
};

/// Scans at the start of a recording, where an odometry has not converged yet.
inline constexpr std::size_t kStartScans = 6;

/// Registers pairs of scans at some places of a recording, three of them among the first
/// kStartScans, neighbours and scans farther apart, in the order of the recording. The given poses
/// are one of several first guesses. Pairs that determine no motion are left out. Throws IoError.
std::vector<RegisteredMotion> register_motions(const Recording& recording);

/// The motion at which a registration of two scans ends that begins at `given`; empty if it is not
/// certain. `a`, `b`: finite points, m, of the scans `first` and `second`.
std::optional<RegisteredMotion> register_from(PointsView a, PointsView b, const Pose& given,
                                              std::size_t first, std::size_t second);

/// Motion of the body between two scans under some reading of the poses; empty without poses.
using BodyMotion = std::function<std::optional<Pose>(const RegisteredMotion&)>;

/// Motion of the sensor between two scans, T_first_second, under a reading of the poses; empty if
/// one of both has no pose.
std::optional<Pose> motion_under(const Recording& recording, const PoseConvention& convention,
                                 std::size_t first, std::size_t second);
/// Returns motion_under() as a function of registered motions. `recording` must outlive it.
BodyMotion motion_under(const Recording& recording, const PoseConvention& convention);

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
