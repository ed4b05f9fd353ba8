// Other meanings of the poses and the points of a recording.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "dynains/io/recording.hpp"
#include "pose_fit.hpp"

namespace dynains {

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
