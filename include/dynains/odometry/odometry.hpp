// A LiDAR odometry: registration of scans to a map of what stands, and removal of what moves, in
// one loop. No IMU.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "dynains/parameters.hpp"
#include "dynains/point_cloud_traits.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/verdict.hpp"

namespace dynains {

/// Parameters of Odometry. visit() gives their meaning and bounds.
struct OdometryConfig {
  double nearest = 1.0;     ///< m
  double farthest = 100.0;  ///< m
  bool remove = true;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(Parameter{"nearest", self.nearest, closed(0, 100), "m",
                      "nearer points are the robot's own and not registered"});
    visitor(Parameter{"farthest", self.farthest, half_open_below(0, 1000), "m",
                      "farther points are not registered, and farther parts of the map forgotten"});
    visitor(Parameter{"remove", self.remove, Bounds(), "", "keep what moves out of the map"});
  }

  /// Throws ConfigError for a field out of bounds, or nearest >= farthest.
  void validate() const;
};

/// Why the odometry does not know where a scan is.
enum class OdometryLoss : unsigned char {
  kNone,
  kFewPoints,  ///< too few points for a registration
  kNoOverlap,  ///< the scan does not fit to the map anywhere near the predicted pose
  kGap         ///< scans are missing for longer than a motion can be predicted
};

constexpr std::array<const char*, 4> value_names(OdometryLoss) {
  return {"none", "too few points", "no overlap with the scans before",
          "too long after the scan before"};
}

/// The answer to one scan.
struct OdometryResult {
  /// At the stamp, in the frame of the first scan at its stamp. After a loss: the predicted pose.
  Pose T_world_sensor = Pose::Identity();
  OdometryLoss loss = OdometryLoss::kNone;
  double fit = 1.0;  ///< mean weight of the points at planes and poles of the map, [0, 1]
  /// Number of directions of motion, of six, that the surfaces do not determine, as along a
  /// corridor. Along them the motion is the predicted one.
  int free_directions = 0;
  /// Verdict of the remover without latency, one label per point, valid until the next push; empty
  /// without `OdometryConfig::remove`, and after a loss.
  Span<const PointLabel> labels;
  std::optional<EpochReason> began_epoch;  ///< that of the remover, as in FrameResult
  Plausibility plausibility;               ///< likewise
};

/// Scans in, poses out. Each scan is predicted at constant velocity, de-skewed to the mean time of
/// its points if they have times, and registered point to plane (poles: point to line) to a map of
/// cells (Chen and Medioni 1992; Geman-McClure weights; degenerate directions as in Zhang, Kaess
/// and Singh 2016). Then the remover judges the scan, and only points that do not move enter the
/// map. The first motions are searched for up to 3 m. Same scans, same bits.
class Odometry {
 public:
  using Config = OdometryConfig;

  /// Throws ConfigError.
  explicit Odometry(const Config& config);
  Odometry(Odometry&&) noexcept;
  Odometry& operator=(Odometry&&) noexcept;
  ~Odometry();

  /// Takes the next scan: points in m, sensor frame; NaN, infinity and the origin are no returns.
  /// `offsets`: for each point the seconds from `time` (s) until it was measured, or none if the
  /// points are all of one time; a point without a finite offset keeps its place. Throws CloudError
  /// if the numbers of offsets and points differ, and PoseError if the mean time of the points is
  /// not after that of the scan before; the state is then unchanged. A lost scan does not enter the
  /// map.
  OdometryResult push(RawPoints<float> points, Span<const double> offsets, double time);

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace dynains
