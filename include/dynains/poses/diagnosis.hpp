// Check of the poses of a recording: whether its scans agree under them.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/poses/sensor_origin.hpp"
#include "dynains/sensor/mounting.hpp"

namespace dynains {

/// Agreement of two scans above the ground.
struct Agreement {
  double share = 0.0;      ///< ratio of points with a point of the other scan within 0.3 m, [0, 1]
  double gap = 1.0;        ///< mean distance to the nearest point of the other scan, m, at most 1
  std::size_t points = 0;  ///< number of compared points
};

/// Agreement under one pose convention.
struct PoseReading {
  std::string meaning;  ///< for messages, for example "the poses are inverse ..."
  std::string option;   ///< flags of `dynains run` that select it, such as "--invert-poses"
  PoseConvention convention;
  Agreement agreement;
};

enum class PoseVerdict {
  kAgree,       ///< scans agree under the given poses
  kOtherwise,   ///< scans agree under another convention, the first of `readings`
  kBodyFrame,   ///< scans agree if the poses are those of a body; see `convention`
  kTimeOffset,  ///< scans agree under poses of another time; see `time_offset`
  kScaled,      ///< scans agree if ways are longer or shorter; see `convention`
  kLostScans,   ///< poses of other rows fit from some scan on; see `lost_scans`
  kInexact,     ///< scans agree, but the motion between neighbouring scans is inexact
  kNoMotion,    ///< too little motion or too few objects for a decision
  kDisagree,    ///< scans agree under no convention
  kSkewed,      ///< scans agree if their points are de-skewed
  kPointTimes,  ///< scans agree better under other times of their points; see `point_times`
  kRayOrigin,   ///< scans agree, but rays begin elsewhere; see `ray_origin`
  kWorldFrame,  ///< points are in the world frame and agree there; poses have no effect
  kUnknown      ///< too few points or scans
};

/// Clouds or rows of poses that are missing somewhere, so that poses belong to other scans behind.
struct LostScans {
  std::size_t first = 0;  ///< scan; poses of their own rows fit up to here
  std::size_t last = 0;   ///< scan; from here on, those `shift` rows later fit
  int shift = 0;
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
  Agreement standing;                 ///< under identity poses (no motion)
  std::vector<PoseReading> readings;  ///< under other conventions, best first
  /// Difference of the given poses and the registration of neighbouring scans: medians over
  /// `registered_pairs`, m and rad.
  double translation_error = 0.0;
  double rotation_error = 0.0;
  std::size_t registered_pairs = 0;  ///< 0 if no motion could be registered
  /// Whether only the poses of the first scans are inexact, as those of an odometry that has not
  /// converged yet; then the errors there, m and rad.
  bool is_inexact_at_start = false;
  double start_translation_error = 0.0;
  double start_rotation_error = 0.0;
  /// Under which scans agree, for kOtherwise, kBodyFrame, kTimeOffset and kScaled.
  PoseConvention convention;
  double time_offset = 0.0;             ///< s, as RecordingOptions::time_offset
  std::optional<LostScans> lost_scans;  ///< for kLostScans
  std::string point_times;              ///< for kPointTimes: what they seem to be
  std::optional<RayOrigin> ray_origin;  ///< if it is not that of the clouds
  std::string option;                   ///< flags of `dynains run` for all of these; empty: none
  PoseVerdict verdict = PoseVerdict::kUnknown;

  /// Whether a run can use the given poses.
  bool sound() const {
    return verdict == PoseVerdict::kAgree || verdict == PoseVerdict::kInexact ||
           verdict == PoseVerdict::kNoMotion || verdict == PoseVerdict::kWorldFrame;
  }
};

/// Smallest Agreement::share that is accepted without further test. Wrong poses of a moving sensor
/// stay below it.
inline constexpr double kLeastAgreement = 0.5;

/// Whether the gap of `a` is clearly smaller than that of `b`.
inline bool is_clearly_better(const Agreement& a, const Agreement& b) {
  return a.gap < 0.85 * b.gap - 0.01;
}

/// Whether scans agree: share >= kLeastAgreement, or (few beams, fast motion) share >= 0.2 and a
/// clearly smaller gap than `standing`, the agreement without motion.
inline bool fits(const Agreement& agreement, const Agreement& standing) {
  return agreement.share >= kLeastAgreement ||
         (agreement.share >= 0.2 && is_clearly_better(agreement, standing));
}

/// Weaker test for consecutive scans with few objects: share >= 0.4, and no clearly smaller gap
/// without motion (`standing`).
inline bool is_passable(const Agreement& agreement, const Agreement& standing) {
  return agreement.share >= 0.4 && !is_clearly_better(standing, agreement);
}

/// Agreement of a sample of scans under the given poses and without motion.
struct PoseAgreement {
  Agreement as_given;
  Agreement standing;
  std::size_t stride = 0;  ///< scan i was compared with scan i + stride

  /// Whether the poses are probably wrong.
  bool doubtful() const {
    return as_given.points >= 200 && !fits(as_given, standing) &&
           !(stride == 1 && is_passable(as_given, standing));
  }
};

/// Compares a sample of scans, in two threads. A few registrations prove right poses; others take
/// more. The time, a second, does not depend on the length of the recording. Throws IoError.
Diagnosis diagnose(const Recording& recording);

/// Compares a small sample of the scans `first` to `last` (inclusive) under the given poses, for
/// the start of a run. Throws IoError.
PoseAgreement pose_agreement(const Recording& recording, std::size_t first, std::size_t last);

/// Whether the scans `first` to `last` (inclusive) prove the given poses, at the places where most
/// mistakes would show: in the sharpest turn, at the largest change of speed and at the highest
/// speed. It costs a few registrations. Poses of more rows than there are scans, which may show
/// lost clouds, are never proved, nor are scans that agree better under other times of their
/// points. That they are not is no finding: see diagnose(). Throws IoError.
bool confirms_poses(const Recording& recording, std::size_t first, std::size_t last);

/// One sentence with the verdict on the poses and the recommended option.
std::string advice(const Diagnosis& diagnosis);

}  // namespace dynains
