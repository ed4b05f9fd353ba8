// Comparison of poses with the motions that scans themselves show, and other meanings of poses and
// points.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/pose.hpp"
#include "dynains/surfaces/scan_registration.hpp"

namespace dynains {

inline constexpr double kExact = 0.03;  ///< m at points 10 m away; registrations are worse rarely
inline constexpr std::size_t kMinMotions = 6;  ///< registered, for a decision
inline constexpr std::size_t kMaxSpan = 9;     ///< scans, of a registered motion

/// Motion of the sensor between two scans, by their registration.
struct RegisteredMotion {
  Pose T_first_second;
  /// Difference of both directions of the registration: translation, and rotation times 10 m, m.
  Vector6 difference;
  double deviation;        ///< m, of a direction that landmarks determine; 0: none
  std::size_t first = 0;   ///< scan
  std::size_t second = 0;  ///< scan
  std::size_t chain = 0;   ///< motions of one chain begin at one scan
};

/// Registers pairs of scans at 12 places of a recording, neighbours and scans farther apart. If the
/// sensor is at rest for most of the time, the places are where its poses move. The given poses are
/// one of several first guesses. Pairs that determine no motion are left out, and pairs whose
/// landmarks match better under the given poses. Places are tried three at a time, far apart, until
/// `suffice` returns true for the motions so far, or six places show no motion. Throws IoError.
std::vector<RegisteredMotion> register_motions(
    const Recording& recording,
    const std::function<bool(const std::vector<RegisteredMotion>&)>& suffice);

/// Those of `motions` over `gap` scans, each by the registrations of both scans to another one,
/// which share no pair of scans with the direct one. Their differences are from that. Without
/// motions that are not determined so.
std::vector<RegisteredMotion> by_other_ways(const Recording& recording,
                                            const std::vector<RegisteredMotion>& motions,
                                            std::size_t gap);

/// Motion of the body between two scans under some reading of the poses; empty without poses.
using BodyMotion = std::function<std::optional<Pose>(std::size_t first, std::size_t second)>;

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

/// `T_body_sensor`: of the body that moves. `gap`: of scans that many apart alone; 0: of all.
MotionError motion_error(const std::vector<RegisteredMotion>& motions, const BodyMotion& body,
                         const Pose& T_body_sensor = Pose::Identity(), std::size_t gap = 0);

/// MotionError::at_points of all motions.
double error_at_points(const std::vector<RegisteredMotion>& motions, const BodyMotion& body);

/// `body`, with the turn from scan to scan that `motions` add to it in the median.
BodyMotion with_drift(const BodyMotion& body, const std::vector<RegisteredMotion>& motions);

/// Hand-eye calibration: T_body_sensor for which the motions of the body and of the sensor agree
/// best. Directions that the motions do not determine stay 0. Empty for fewer than 4 motions.
std::optional<Pose> fit_extrinsic(const std::vector<RegisteredMotion>& registered,
                                  const BodyMotion& body);

/// A meaning of the poses.
struct Reading {
  PoseConvention convention;
  double time_offset = 0.0;  ///< s, as RecordingOptions::time_offset
  /// 0 for the given meaning; 1 for each usual mistake and for a fitted offset, of which a shift is
  /// a coarse one; 2 for a fitted scale, 3 for a fitted body. A more complex reading must explain
  /// clearly more.
  std::size_t complexity = 0;
};

/// The motion of the sensor under a reading. `recording` must outlive the result.
BodyMotion motion_under(const Recording& recording, const Reading& reading);
/// That under the given meaning.
inline BodyMotion given_motion(const Recording& recording) {
  return motion_under(recording,
                      {recording.options().convention, recording.options().time_offset, 0});
}

/// Whether an error (m) of points 10 m from the sensor is clearly smaller than another one.
bool is_much_smaller(double error, double other);

/// All combinations of common mistakes, also of options that were given; shifts alone.
std::vector<Reading> usual_readings(const Recording& recording);

/// A scale of the ways, an offset of the clocks, and bodies that carry the sensor, as far as the
/// motions of one half of the chains give one that explains the other half much better.
std::vector<Reading> fitted_readings(const Recording& recording,
                                     const std::vector<RegisteredMotion>& motions);

/// Whether points in the files move with the sensor, as those in the frame of the world do. Empty
/// if the sensor stays within `min_way` (m) of its first place. Throws IoError.
std::optional<bool> follow_sensor(const Recording& recording, double min_way);

/// Other ways to read the points of a recording that does not agree: de-skewed or not, in the frame
/// of the sensor or of the world, or with rays from `ray_origin` (m, frame of the clouds in the
/// files). Throws IoError.
std::vector<RecordingOptions> other_options(const Recording& recording,
                                            const std::optional<Eigen::Vector3d>& ray_origin);

}  // namespace dynains
