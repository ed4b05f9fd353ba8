// LiDAR odometry without an IMU: registers scans to a static map and removes moving points, in one
// loop.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "dynains/compiled_remover.hpp"
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
                      "nearer points are the robot's own and not registered; less in small rooms"});
    visitor(Parameter{"farthest", self.farthest, half_open_below(0, 1000), "m",
                      "farther points are not registered, and farther parts of the map forgotten"});
    visitor(Parameter{"remove", self.remove, Bounds(), "", "keep moving points out of the map"});
  }

  /// Throws ConfigError for a field out of bounds, or nearest >= farthest.
  void validate() const;
};

/// Why the pose of a scan is unknown.
enum class OdometryLoss : unsigned char {
  kNone,
  kFewPoints,  ///< too few points for a registration
  kNoOverlap,  ///< the scan does not fit to the map anywhere near the predicted pose
  kGap         ///< scans are missing for longer than a motion can be predicted: a new map begins
};

constexpr std::array<const char*, 4> value_names(OdometryLoss) {
  return {"none", "too few points", "no overlap with the scans before",
          "too long after the scan before"};
}

/// Result of one push.
struct OdometryResult {
  /// Pose at the stamp, m, in the frame of the first scan at its stamp, or of the other odometry,
  /// whose first pose is kept. After a loss: the predicted pose.
  Pose T_world_sensor = Pose::Identity();
  OdometryLoss loss = OdometryLoss::kNone;
  double fit = 1.0;  ///< mean weight of the points at planes and poles of the map, [0, 1]
  /// Number of directions of motion, of six, that the surfaces do not determine, as along a
  /// corridor. Along them the motion is the predicted one.
  int free_directions = 0;
  /// Result of the remover, with one label per pushed point; empty without
  /// `OdometryConfig::remove`, and for a scan that does not enter the map.
  FrameResult frame;
};

/// Scans in, poses out. Each scan is predicted at constant velocity, de-skewed to the mean time of
/// its points if they have times, and registered point to plane (poles: point to line) to a map of
/// cells (Chen and Medioni 1992; Geman-McClure weights; degenerate directions as in Zhang, Kaess
/// and Singh 2016). Then the remover judges the scan, and only points that do not move enter the
/// map. The first motion is searched for up to 6 m along the direction that the surfaces determine
/// worst, by vegetation, poles and signs. Results are deterministic.
class Odometry {
 public:
  using Config = OdometryConfig;

  /// `remover`: parameters of the removal, whose own registration is left out, and the sensors,
  /// whose points register together. Throws ConfigError.
  explicit Odometry(const Config& config = {},
                    const DynaInsRemover::Config& remover = DynaInsRemover::Config::odometry());
  Odometry(Odometry&&) noexcept;
  Odometry& operator=(Odometry&&) noexcept;
  ~Odometry();

  /// Takes the next scan: any cloud with PointCloudTraits, in m, sensor frame; NaN, infinity and
  /// the origin are no returns. Points of several sensors are in one frame, each as measured at its
  /// time. `offsets`: for each point the seconds from `time` (s) until it was
  /// measured, or none if the points are all of one time; a point without a finite offset is not
  /// moved. Throws CloudError if the numbers of offsets and points differ, and PoseError if the
  /// mean time of the points is not after that of the scan before; the state is then unchanged. A
  /// lost scan does not enter the map, and the next scans are registered to the same map. After a
  /// gap (OdometryLoss::kGap), the predicted motion is kept, and a new map begins.
  template <class Cloud>
  OdometryResult push(const Cloud& cloud, Span<const double> offsets, double time) {
    return register_scan(detail::CloudView(cloud), offsets, time, std::nullopt);
  }

  /// As above, behind another odometry: its motions replace the prediction at constant velocity, so
  /// they are kept along directions that the surfaces do not determine. `T_odometry_sensor`: its
  /// pose of the sensor, m, without corrections, always at the same time within a scan. If the scan
  /// is lost, its motion is kept, and a new map begins unless the points are too few. Also throws
  /// PoseError for a pose that is not rigid.
  template <class Cloud, class PoseLike>
  OdometryResult push(const Cloud& cloud, Span<const double> offsets, double time,
                      const PoseLike& T_odometry_sensor) {
    return register_scan(detail::CloudView(cloud), offsets, time, to_pose(T_odometry_sensor));
  }

 private:
  OdometryResult register_scan(const detail::CloudView& cloud, Span<const double> offsets,
                               double time, const std::optional<Pose>& T_odometry_sensor);

  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace dynains
