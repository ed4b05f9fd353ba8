// Motions of the sensor between scans, by registration of the scans.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "cell_surfaces.hpp"
#include "dynains/io/recording.hpp"
#include "scan_registration.hpp"

namespace dynains {

/// Motion of the sensor between two scans, by their registration.
struct RegisteredMotion {
  std::size_t chain;   ///< motions of one chain begin at one scan
  std::size_t first;   ///< scan
  std::size_t second;  ///< scan
  Pose T_first_second;
  /// Difference of both directions of the registration, as motion_residual().
  Vector6 difference;
  double deviation;  ///< m, of a direction that landmarks determine; 0: none
};

/// Scans at the start of a recording, where an odometry has not converged yet.
inline constexpr std::size_t kStartScans = 6;

/// Distance (m) of the points at which a rotation is judged.
inline constexpr double kLever = 10.0;

/// Angle of a rotation, rad.
inline double rotation_angle(const Pose& T) {
  return std::abs(Eigen::AngleAxisd(T.linear()).angle());
}

/// Difference of two motions: rotation times kLever, and translation, m.
inline Vector6 motion_residual(const Pose& a, const Pose& b) {
  const Pose E = a.inverse() * b;
  const Eigen::AngleAxisd rotation(detail::Quaternion(E.linear()));
  Vector6 r;
  r << kLever * rotation.angle() * rotation.axis(), E.translation();
  return r;
}

/// A motion by two registrations, forth and back.
struct CheckedMotion {
  Pose T_a_b;
  Vector6 difference;  ///< as motion_residual()
  double deviation;    ///< m, as RegisteredMotion::deviation
};

/// Empty unless both registrations are certain and nearly equal. `uncertain`: m, bound of the
/// uncertainty of their translation.
std::optional<CheckedMotion> checked(const std::optional<Registration>& forth,
                                     const std::optional<Registration>& back, double uncertain,
                                     double deviation);

/// Registers pairs of scans at some places of a recording, three of them among the first
/// kStartScans, neighbours and scans farther apart. The given poses are one of several first
/// guesses. Pairs that determine no motion are left out. Throws IoError.
std::vector<RegisteredMotion> register_motions(const Recording& recording);

}  // namespace dynains
