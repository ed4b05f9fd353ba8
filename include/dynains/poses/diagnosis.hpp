// Check of the poses of a recording: do its scans agree under them, under which others would they,
// and how inexact are they? Also of what else its clouds mean: where their beams begin, how far
// these go around, and whether several sensors agree.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/pose.hpp"
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

/// Position (m, frame of the clouds in the files) at which the beams of a spinning sensor begin, if
/// it lies elsewhere than the recording says: points of one beam have one elevation (a ring is a
/// cone) from there, and clearly not from the origin of the scans. Scans at three places have to
/// agree about it. Empty if the origin is right, or if the pattern or the scene do not determine
/// it. Throws IoError.
std::optional<Eigen::Vector3d> other_ray_origin(const Recording& recording);

/// Ratio of a turn by which the clouds of the scans `first` to `last` are more than one, so that
/// both ends show one place at two times; 0 if less than 1.5 deg, if they are de-skewed or of
/// several sensors, or if their points are not in the order of a turn. Throws IoError.
double overlap_of_turns(const Recording& recording, std::size_t first, std::size_t last);

/// Findings on one sensor of several.
struct SensorAgreement {
  double points = 0.0;         ///< returns of a scan
  double fit_of_scans = 0.0;   ///< of its points at its surfaces in other scans, as in Registration
  double fit_of_others = 0.0;  ///< of its points at the surfaces of the other sensors
  /// Its pose in the frame of the clouds by a registration to the surfaces of the other sensors.
  /// Along directions that they do not determine, that of the recording stays.
  Pose T_cloud_sensor = Pose::Identity();
  double distance = 0.0;  ///< m, from the pose of the recording
  double angle = 0.0;     ///< rad

  /// Whether the pose of the recording is off by more than 3 cm or 0.3 deg.
  bool is_off() const { return distance > 0.03 || angle > 0.3 * M_PI / 180.0; }
};

/// By sensor of the recording; empty for one alone. Reads a sample of the scans. Throws IoError.
std::vector<SensorAgreement> compare_sensors(const Recording& recording);

}  // namespace dynains
