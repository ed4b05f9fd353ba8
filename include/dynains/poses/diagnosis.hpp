// Check of the poses of a recording: do its scans agree under them, under which others would they,
// and how inexact are they?
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>

#include "dynains/io/recording.hpp"
#include "dynains/sensor/mounting.hpp"
#include "dynains/surfaces/landmarks.hpp"

namespace dynains {

enum class PoseVerdict {
  kAgree,      ///< scans agree under the given poses
  kInexact,    ///< scans agree, but the motion over some scans is inexact
  kNoMotion,   ///< too little motion or too few objects for a decision
  kOtherwise,  ///< scans agree under `proposal`
  kDisagree,   ///< scans agree under nothing that was tried
  kUnknown     ///< too few points or scans
};
constexpr std::array<const char*, 6> value_names(PoseVerdict) {
  return {"agree", "inexact", "no motion", "otherwise", "disagree", "unknown"};
}

/// Faults of poses that no option corrects.
struct PoseFlaws {
  bool has_equal_orientations = false;  ///< all orientations are equal, though the way bends
  /// Scans this many apart agree clearly better than neighbours, because several sensors, or parts
  /// of a revolution, take turns; 0: no such period.
  std::size_t period = 0;
};

struct Diagnosis {
  std::size_t scan_files = 0;
  std::size_t pose_rows = 0;
  std::size_t scans = 0;       ///< scans with a pose
  double period = 0.0;         ///< median time between consecutive scans, s
  double points = 0.0;         ///< mean number of points per scan
  double invalid_share = 0.0;  ///< ratio of points that are NaN, infinite or all zero, [0, 1]
  double ego_share = 0.0;      ///< ratio of valid points nearer than 2 m, [0, 1]
  double farthest = 0.0;       ///< 99th percentile of the ranges, m
  double step = 0.0;           ///< median distance between consecutive poses, m
  double longest_step = 0.0;   ///< largest distance between consecutive poses, m
  Mounting mounting;           ///< median over the scans with detected ground
  std::size_t stride = 0;      ///< scan i was compared with scan i + stride
  Agreement as_given;
  Agreement standing;  ///< under identity poses (no motion)
  /// Difference of the given poses and the registration of scans `error_span` apart: medians over
  /// `registered_pairs`, m and rad.
  double translation_error = 0.0;
  double rotation_error = 0.0;
  std::size_t error_span = 1;        ///< scans, 1 unless errors only show over more
  std::size_t registered_pairs = 0;  ///< 0 if too few for a statement
  PoseFlaws flaws;
  RecordingOptions proposal;  ///< the given options, changed for kOtherwise
  PoseVerdict verdict = PoseVerdict::kUnknown;

  /// Whether a run can use the given poses.
  bool sound() const {
    return verdict == PoseVerdict::kAgree || verdict == PoseVerdict::kInexact ||
           verdict == PoseVerdict::kNoMotion;
  }
};

/// Pose of scan k in the sensor frame of scan i, as given.
inline Pose motion_between(const Recording& recording, std::size_t i, std::size_t k) {
  return recording.T_world_sensor(i).inverse() * recording.T_world_sensor(k);
}

/// Whether the given poses are exact and determined at up to three places: scans between
/// which they move by 2 m meet within 3 cm, forth and back, from the given motion. A fraction of
/// the work of diagnose(); false says nothing. Throws IoError.
bool are_poses_exact(const Recording& recording);

/// Compares and registers a sample of scans, in two threads. It takes about a second for a
/// recording of any length. If scans do not agree, the recording may be opened again with other
/// options. `pairs`: number of registered pairs of neighbours after which it stops if nearly all
/// are exact. Throws IoError.
Diagnosis diagnose(const Recording& recording, std::size_t pairs = 6);

}  // namespace dynains
