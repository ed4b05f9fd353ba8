// Verdicts on points with their causes, and the result of one push.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"

namespace dynains::detail {

/// Samples of one scan on the ground and on the instances above it.
struct SurfaceCounts {
  std::uint64_t ground_hit = 0;         ///< hits of ground samples, over all references
  std::uint64_t ground_free = 0;        ///< beams through ground samples, over all references
  std::uint64_t instances_decided = 0;  ///< samples in free or occupied supervoxels
  std::uint64_t instances_free = 0;     ///< samples in free supervoxels

  SurfaceCounts& operator+=(const SurfaceCounts& other) {
    ground_hit += other.ground_hit;
    ground_free += other.ground_free;
    instances_decided += other.instances_decided;
    instances_free += other.instances_free;
    return *this;
  }
};

}  // namespace dynains::detail

namespace dynains {

/// Cause of the verdict on one point. `dynains run` writes these numbers to OUT/causes/NNNNNN.cause
/// (one uint8 per input point, in input order), so existing numbers must not change.
enum class Cause : std::uint8_t {
  kUnknown = 0,
  kGround = 1,             ///< static: ground
  kSimilar = 2,            ///< static: similarity of occupancy not below tau_s (Eq. 12)
  kReverted = 3,           ///< static: proposed as dynamic, reverted by belief (Eq. 19) or votes
  kTooFewPoints = 4,       ///< static: cluster too small (not used by this pipeline)
  kTooFewScans = 5,        ///< static: cluster without points in the oldest or newest scan (Eq. 11)
  kNotJudged = 6,          ///< invalid, out of range, or static without a cluster
  kProposed = 7,           ///< dynamic: proposed by occupancy and not reverted (Eq. 19)
  kFreeSpace = 8,          ///< dynamic: its position is free according to other scans
  kWithInstance = 9,       ///< dynamic: part of its instance is free according to other scans
  kUnderInstance = 10,     ///< dynamic: ground point below a removed instance
  kNoEvidence = 11,        ///< static: no evidence of other scans
  kAlongTrack = 12,        ///< dynamic: its instance moved in other scans
  kPresumed = 13,          ///< dynamic, provisionally: no evidence of earlier scans
  kOccupied = 14,          ///< static: its position is occupied according to other scans
  kTooLittleFree = 15,     ///< static: too few scans with free space, or too few free samples
  kDynamicOccupancy = 16,  ///< dynamic: most other points in its dynamic grid cell are dynamic
  kCameOrWent = 17,        ///< dynamic: scans of the whole recording saw it come or go
  kStands = 18,            ///< static: removed by the first pass, but it came to stay
};

/// Number of causes: they are 0 to kCauseCount - 1.
inline constexpr std::size_t kCauseCount = 19;

/// Whether a point with this cause is removed.
constexpr bool is_dynamic(Cause cause) {
  constexpr auto bit = [](Cause c) { return 1U << static_cast<unsigned>(c); };
  constexpr unsigned kDynamic = bit(Cause::kProposed) | bit(Cause::kFreeSpace) |
                                bit(Cause::kWithInstance) | bit(Cause::kUnderInstance) |
                                bit(Cause::kAlongTrack) | bit(Cause::kPresumed) |
                                bit(Cause::kDynamicOccupancy) | bit(Cause::kCameOrWent);
  return (kDynamic >> static_cast<unsigned>(cause) & 1U) != 0;
}

/// Why no correct recording gives the scans of a running window.
enum class Suspicion : std::uint8_t {
  kNone,
  kUnits,  ///< nearly no point can be judged: units, frame or ranges of the points
  kPoses,  ///< scans do not fit to each other under the poses
  kRays,   ///< scans fit, but beams pass through static objects: origin of rays, times of points
};

constexpr std::array<const char*, 4> value_names(Suspicion) {
  return {"none", "units", "poses", "rays"};
}

/// Shares over the last scans, [0, 1].
struct Plausibility {
  float not_judged = 0.0F;     ///< points that are invalid, too near or too far
  float ground_free = 0.0F;    ///< beams through the ground, of those that reach or pass it, in all
                               ///< scans but the worst
  float instance_free = 0.0F;  ///< samples above the ground seen free, of those seen free or hit
  float misfits = 0.0F;        ///< scans that begin an epoch because poses or surfaces do not fit
  float residual = 0.0F;       ///< m, mean translation of PoseResidual, each at most 0.15 m
  Suspicion suspicion = Suspicion::kNone;
  std::uint64_t since = 0;  ///< number of the push at which the suspicious window began

  /// Raises each share to that of another window.
  void raise_shares(const Plausibility& other) {
    not_judged = std::max(not_judged, other.not_judged);
    ground_free = std::max(ground_free, other.ground_free);
    instance_free = std::max(instance_free, other.instance_free);
    misfits = std::max(misfits, other.misfits);
    residual = std::max(residual, other.residual);
  }
};

/// How a scan is compared with others.
struct ComparedPose {
  /// As pushed, or corrected by the motion stage (FreeSpaceConfig::pose_tolerance).
  Pose T_world_sensor = Pose::Identity();
  std::uint64_t epoch = 0;                 ///< only scans of one epoch are compared
  Suspicion suspicion = Suspicion::kNone;  ///< see Plausibility
};

/// Time per stage of one call, ms.
struct StageTimes {
  double ingest = 0.0;    ///< copy of the cloud, labels of invalid points
  double ground = 0.0;    ///< ground segmentation
  double window = 0.0;    ///< Eq. 3
  double cluster = 0.0;   ///< curved voxels
  double motion = 0.0;    ///< alignment with the planes of earlier scans
  double evidence = 0.0;  ///< Eq. 4-19 of the window, or the free-space evidence of the newest scan
  double judge = 0.0;     ///< verdicts by free space on instances; images and planes of references
  double verdict = 0.0;   ///< verdicts on ground and points; FrameResult::newest() is not included
  double map = 0.0;       ///< Eq. 1

  template <class Self, class Visitor>
  static void visit(Self&& self, Visitor&& visitor) {
    visitor("ingest", self.ingest);
    visitor("ground", self.ground);
    visitor("window", self.window);
    visitor("cluster", self.cluster);
    visitor("motion", self.motion);
    visitor("evidence", self.evidence);
    visitor("judge", self.judge);
    visitor("verdict", self.verdict);
    visitor("map", self.map);
  }

  /// Sum of all stages, ms.
  double total() const {
    double result = 0.0;
    visit(*this, [&result](const char*, double milliseconds) { result += milliseconds; });
    return result;
  }
};

/// An instance that moves, as an upright box. RemoverConfig::objects.
struct MovingObject {
  std::uint32_t id = 0;  ///< the same in all scans, also after up to 1 s in which it was not seen
  /// m, world frame, at the time of its points.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  /// m, along the yaw, across it, and of the points along z. Sides that the sensor has not seen yet
  /// are missing; an object that is as wide as a car and shows its front or rear is 4.5 m long.
  double length = 0.0, width = 0.0, height = 0.0;
  /// rad, about z of the world frame: direction of the motion, or of the longest side while that is
  /// unknown.
  double yaw = 0.0;
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  ///< m/s, along x and y of the world frame
  std::uint32_t points = 0;                            ///< in this scan
  std::uint64_t first_scan = 0, last_scan = 0;         ///< with the object, up to the newest push

  /// Calls `visitor(name, number)` for each number.
  template <class Self, class Visitor>
  static void visit(Self&& self, Visitor&& visitor) {
    visitor("id", self.id);
    visitor("x", self.centre.x());
    visitor("y", self.centre.y());
    visitor("z", self.centre.z());
    visitor("length", self.length);
    visitor("width", self.width);
    visitor("height", self.height);
    visitor("yaw", self.yaw);
    visitor("vx", self.velocity.x());
    visitor("vy", self.velocity.y());
    visitor("points", self.points);
    visitor("first_scan", self.first_scan);
    visitor("last_scan", self.last_scan);
  }
};

/// Verdict on every point of one scan. Each span has one value per input point, in input order, and
/// is valid until the next call of the remover.
struct ScanVerdict {
  std::uint64_t scan = 0;  ///< number of the push, from 0
  double time = 0.0;       ///< s, as pushed
  Pose T_world_sensor = Pose::Identity();
  Span<const PointLabel> labels = {};
  /// kNoInstance for ground and points without a cluster.
  Span<const std::uint32_t> instances = {};
  /// Probability of being dynamic, [0, 1]. It is 0 for points without a belief: static ground,
  /// points without a cluster and, for decision = window, points that were not proposed. For
  /// decision = free_space, all other points have at least 0.5, even if they are occupied or
  /// without evidence.
  Span<const float> beliefs = {};
  Span<const Cause> causes = {};
  ComparedPose compared = {};
  Span<const MovingObject> objects = {};  ///< by id; empty without RemoverConfig::objects
};

namespace detail {
/// Makes the verdict on the newest scan.
class NewestVerdictMaker {
 public:
  /// Throws UsageError during another call, and unless `scan` is the newest one.
  virtual const ScanVerdict& newest_verdict(std::uint64_t scan) = 0;

 protected:
  ~NewestVerdictMaker() = default;
};
}  // namespace detail

/// Verdict on a pushed scan from this scan and earlier ones. It is computed at the first call of
/// operator(), so it costs nothing if it is not used.
class NewestVerdict {
 public:
  NewestVerdict() = default;
  NewestVerdict(const ScanVerdict& made) : verdict_(made) {}
  NewestVerdict(detail::NewestVerdictMaker& maker, std::uint64_t scan) : maker_(&maker) {
    verdict_.scan = scan;
  }

  /// The first call counts as a call of the remover: it throws UsageError during another one, and
  /// after the next push. It may throw std::bad_alloc. The spans are valid until the next call of
  /// the remover.
  const ScanVerdict& operator()() const {
    if (maker_ != nullptr) verdict_ = maker_->newest_verdict(verdict_.scan);
    maker_ = nullptr;
    return verdict_;
  }

 private:
  mutable detail::NewestVerdictMaker* maker_ = nullptr;  // null: the verdict is made
  mutable ScanVerdict verdict_;
};

/// Alignment of a scan with the static surfaces of earlier scans: the error of the pushed motion of
/// the sensor since the previous scan.
struct PoseResidual {
  double translation = 0.0;  ///< m
  double rotation = 0.0;     ///< deg
  /// Corrected motion: pose of this scan in the sensor frame of the previous one. It is the pushed
  /// motion, except for rounding, if neither of both poses was corrected.
  Pose T_previous_newest = Pose::Identity();
  /// The motion that fits best, whether or not it is certain. Errors of a chain of them are not
  /// independent. It depends on the pushed motion where is_supported() is false.
  Pose T_previous_aligned = Pose::Identity();
  /// Covariance of an error e of T_previous_aligned, row-major: translation along the axes x, y, z
  /// of the newest sensor frame (m), and rotation about them (rad); exact motion = aligned motion *
  /// Exp(e). The pose of the previous scan is taken as exact.
  std::array<double, 36> covariance = {};

  /// The previous scan: the last push that did not throw.
  std::uint64_t previous_scan = 0;  ///< number of its push, as ScanVerdict::scan
  double previous_time = 0.0;       ///< s, as pushed

  /// Whether the surfaces determine the error along an axis (0 to 5, as in `covariance`) to 10 cm:
  /// three standard deviations; for a rotation, of a point 10 m away.
  bool is_supported(std::size_t axis) const {
    const double deviation = std::sqrt(covariance[7 * axis]) * (axis < 3 ? 1.0 : 10.0);
    return 3.0 * deviation <= 0.1;
  }
};

/// Doubt about the times of the last four scans.
enum class TimeDoubt : std::uint8_t {
  kNone,
  kTooSlow,  ///< all more than max_gap apart: no scan is compared. Milliseconds for seconds?
  kTooFast   ///< all less than 1 ms apart: faster than any LiDAR
};

/// Why a scan begins an epoch: it is not compared with earlier scans.
enum class EpochReason : std::uint8_t {
  kStart,   ///< first scan, also after flush(), start_epoch(), reset() or an exception
  kSensor,  ///< first scan with enough points for the model of the sensor
  kPause,   ///< a longer time than `max_gap` since the scan before
  kJump,    ///< the pose jumped: no motion leads to it, or its surfaces fit to the motion before it
  kMisfit,  ///< its surfaces do not fit to earlier scans
};

constexpr std::array<const char*, 5> value_names(EpochReason) {
  return {"start", "sensor", "pause", "jump", "misfit"};
}

/// Result of one push.
struct FrameResult {
  NewestVerdict newest;  ///< newest(): by the pushed scan and earlier ones; final if latency() is 0
  std::optional<ScanVerdict> finished;  ///< final verdict on the scan latency() pushes ago
  StageTimes times;
  /// Empty for the first scan of an epoch, without enough common surfaces, and if free space is not
  /// used (decision = window) or `pose_tolerance` is 0.
  std::optional<PoseResidual> pose_residual;
  TimeDoubt time_doubt = TimeDoubt::kNone;
  /// Set if the scan begins an epoch. After kJump and kMisfit, the pushed motion since the previous
  /// scan is wrong.
  std::optional<EpochReason> began_epoch;
  /// Plausibility of the last scans, by free space; zero for decision = window, except
  /// `not_judged`.
  Plausibility plausibility;
};

/// Verdict by free space on one scan. Each non-ground point belongs to a group with one verdict;
/// the groups of a scan do not change between its verdicts. Ground points are static unless listed.
struct EvidenceVerdict {
  struct Group {
    Cause cause = Cause::kNotJudged;  ///< see is_dynamic()
    float belief = 0.0F;              ///< probability of being dynamic

    friend bool operator==(const Group& a, const Group& b) {
      return a.cause == b.cause && a.belief == b.belief;
    }
  };
  struct GroundPoint {
    std::uint32_t point;  ///< index in GroundSplit::ground()
    Group verdict;
  };

  Span<const Group> groups;              ///< the first one: points in no cluster
  Span<const std::uint32_t> cluster_of;  ///< by group but the first one
  Span<const std::uint32_t> group_of;    ///< by non-ground point, in the order of the split
  Span<const GroundPoint> ground;        ///< dynamic ground points, each at most once
};

}  // namespace dynains
