// Will this recording work? What its scans and poses say about each other.
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

/// How well two scans agree where both stand up from the ground.
struct Agreement {
  double share = 0.0;      ///< part of the points that the other scan has a point within 0.3 m of
  double gap = 1.0;        ///< mean distance to the nearest point of the other scan, at most 1, m
  std::size_t points = 0;  ///< points compared; 0: nothing to compare
};

/// Points of one scan that say where it was taken: above the ground, one for every 0.25 m, between
/// 2 and 40 m from the sensor.
class Landmarks {
 public:
  /// Points in the frame of the sensor; ground is told by `mounting` if it is known.
  Landmarks(PointsView points, const Mounting& mounting);

  std::size_t size() const { return points_.size(); }
  /// Agreement of `other` with this, placed by its pose in the frame of this. Symmetric but for
  /// occlusion.
  Agreement compare(const Landmarks& other, const Eigen::Isometry3d& T_this_other) const;

 private:
  double distance_to(const Eigen::Vector3d& p) const;

  std::vector<std::uint64_t> cells_;  // of 1 m, ascending, one for each point
  std::vector<Eigen::Vector3d> points_;
};

/// One reading of the poses.
struct PoseReading {
  std::string meaning;  ///< "the poses are inverse ..."
  std::string option;   ///< flags of `dynains run` that choose it, such as "--invert-poses"
  PoseConvention convention;
  Agreement agreement;
};

enum class PoseVerdict {
  kAgree,      ///< as given
  kOtherwise,  ///< under another reading: `best`
  kNoMotion,   ///< the sensor hardly moves or turns, or too little is in sight: nothing can be told
  kDisagree,   ///< under no reading
  kWorldFrame,  ///< points are in the world frame and agree there, whatever the poses
  kUnknown      ///< too few points or scans
};

struct Diagnosis {
  std::size_t scan_files = 0;
  std::size_t pose_rows = 0;
  std::size_t scans = 0;       ///< with a pose
  double period = 0.0;         ///< median time from scan to scan, s
  double points = 0.0;         ///< per scan
  double invalid_share = 0.0;  ///< NaN, infinite or all zero
  double ego_share = 0.0;      ///< nearer than 2 m, of the valid ones
  double farthest = 0.0;       ///< 99th percentile of the ranges, m
  double step = 0.0;           ///< median distance from scan to scan under the poses, m
  double longest_step = 0.0;   ///< m
  Mounting mounting;           ///< median over the scans that show their ground
  std::size_t stride = 0;      ///< scans apart that were compared
  Agreement as_given;
  Agreement standing;                 ///< as if the sensor did not move at all
  std::vector<PoseReading> readings;  ///< the usual mistakes, best first
  PoseVerdict verdict = PoseVerdict::kUnknown;

  /// Whether nothing speaks against a run.
  bool sound() const {
    return verdict == PoseVerdict::kAgree || verdict == PoseVerdict::kNoMotion ||
           verdict == PoseVerdict::kWorldFrame;
  }
};

/// Share of agreeing points that no wrong pose reaches where the sensor moves.
inline constexpr double kLeastAgreement = 0.5;

/// Whether `a` explains the scans clearly better than `b`.
inline bool is_clearly_better(const Agreement& a, const Agreement& b) {
  return a.gap < 0.85 * b.gap - 0.01;
}

/// Whether scans agree well enough: most of the points, or, for few beams and fast motion, some of
/// them and clearly more than if the sensor stood still.
inline bool fits(const Agreement& agreement, const Agreement& standing) {
  return agreement.share >= kLeastAgreement ||
         (agreement.share >= 0.2 && is_clearly_better(agreement, standing));
}

/// Whether neighbouring scans agree passably, and not clearly better as if the sensor stood still:
/// all that can be asked where little stands beside the way.
inline bool is_passable(const Agreement& agreement, const Agreement& standing) {
  return agreement.share >= 0.4 && !is_clearly_better(standing, agreement);
}

/// Agreement of a sample of scans under the poses, and as if the sensor did not move.
struct PoseAgreement {
  Agreement as_given;
  Agreement standing;
  std::size_t stride = 0;  ///< scans apart that were compared

  /// Whether the poses are wrong rather than the scans hard.
  bool doubtful() const {
    return as_given.points >= 200 && !fits(as_given, standing) &&
           !(stride == 1 && is_passable(as_given, standing));
  }
};

/// Looks at a sample of scans; takes seconds, whatever the length. Throws IoError.
Diagnosis diagnose(const Recording& recording);

/// The same for the poses as they are only, over a sample of the scans `first` to `last`
/// (inclusive): cheap enough to start a run with. Throws IoError.
PoseAgreement pose_agreement(const Recording& recording, std::size_t first, std::size_t last);

/// The verdict on the poses, and what to do, in one sentence.
std::string advice(const Diagnosis& diagnosis);

}  // namespace dynains
