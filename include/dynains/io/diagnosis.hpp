// Checks whether the scans of a recording agree under its poses.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"
#include "dynains/sensor/mounting.hpp"

namespace dynains {

/// How well two scans agree above the ground.
struct Agreement {
  double share = 0.0;      ///< part of the points with a point of the other scan within 0.3 m
  double gap = 1.0;        ///< mean distance to the nearest point of the other scan, at most 1, m
  std::size_t points = 0;  ///< points compared; 0: nothing to compare
};

/// Points of one scan by which it is aligned with others: above the ground, one in each voxel of
/// 0.25 m, between 2 and 40 m from the sensor.
class Landmarks {
 public:
  /// Points in the sensor frame, m. If `mounting` is known, points near the ground are left out.
  Landmarks(PointsView points, const Mounting& mounting);

  std::size_t size() const { return points_.size(); }
  /// Agreement of `other` with this scan under the pose `T_this_other`. Symmetric apart from
  /// occlusion.
  Agreement compare(const Landmarks& other, const Eigen::Isometry3d& T_this_other) const;

 private:
  double distance_to(const Eigen::Vector3d& p) const;

  std::vector<std::uint64_t> cells_;  // voxel (1 m) of each point, ascending
  std::vector<Eigen::Vector3d> points_;
};

/// The poses under one convention.
struct PoseReading {
  std::string meaning;  ///< "the poses are inverse ..."
  std::string option;   ///< flags of `dynains run` that select it, such as "--invert-poses"
  PoseConvention convention;
  Agreement agreement;
};

enum class PoseVerdict {
  kAgree,       ///< scans agree under the poses as given
  kOtherwise,   ///< scans agree under another convention, the first of `readings`
  kNoMotion,    ///< the sensor hardly moves, or too little is in sight, for a decision
  kDisagree,    ///< scans agree under no convention
  kWorldFrame,  ///< points are in the world frame and agree there; poses do not matter
  kUnknown      ///< too few points or scans
};

struct Diagnosis {
  std::size_t scan_files = 0;
  std::size_t pose_rows = 0;
  std::size_t scans = 0;       ///< scans with a pose
  double period = 0.0;         ///< median time from scan to scan, s
  double points = 0.0;         ///< mean number per scan
  double invalid_share = 0.0;  ///< part of the points that are NaN, infinite or all zero
  double ego_share = 0.0;      ///< part of the valid points nearer than 2 m
  double farthest = 0.0;       ///< 99th percentile of the ranges, m
  double step = 0.0;           ///< median distance from scan to scan under the poses, m
  double longest_step = 0.0;   ///< m
  Mounting mounting;           ///< median over the scans in which ground was found
  std::size_t stride = 0;      ///< scan i was compared with scan i + stride
  Agreement as_given;
  Agreement standing;                 ///< under the identity: no motion at all
  std::vector<PoseReading> readings;  ///< under common mistakes, best first
  PoseVerdict verdict = PoseVerdict::kUnknown;

  /// Whether a run can use the poses as they are.
  bool sound() const {
    return verdict == PoseVerdict::kAgree || verdict == PoseVerdict::kNoMotion ||
           verdict == PoseVerdict::kWorldFrame;
  }
};

/// Share of agreeing points that wrong poses of a moving sensor do not reach.
inline constexpr double kLeastAgreement = 0.5;

/// Whether the gap of `a` is clearly smaller than that of `b`.
inline bool is_clearly_better(const Agreement& a, const Agreement& b) {
  return a.gap < 0.85 * b.gap - 0.01;
}

/// Whether scans agree well enough: half of the points, or (few beams, fast motion) a fifth of them
/// and clearly more than without motion.
inline bool fits(const Agreement& agreement, const Agreement& standing) {
  return agreement.share >= kLeastAgreement ||
         (agreement.share >= 0.2 && is_clearly_better(agreement, standing));
}

/// Weaker test for neighbouring scans where few objects are in sight: some agreement, and no
/// clearly better agreement without motion.
inline bool is_passable(const Agreement& agreement, const Agreement& standing) {
  return agreement.share >= 0.4 && !is_clearly_better(standing, agreement);
}

/// Agreement of a sample of scans under the poses, and without motion.
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

/// Compares a sample of scans: takes seconds for any length of the recording. Throws IoError.
Diagnosis diagnose(const Recording& recording);

/// Compares a sample of the scans `first` to `last` (inclusive) under the poses as given: cheap
/// enough for the start of a run. Throws IoError.
PoseAgreement pose_agreement(const Recording& recording, std::size_t first, std::size_t last);

/// The verdict on the poses and the option to use, in one sentence.
std::string advice(const Diagnosis& diagnosis);

}  // namespace dynains
