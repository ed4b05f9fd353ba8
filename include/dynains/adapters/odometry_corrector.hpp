// The loop around an odometry: corrected poses and the moving points of each scan.
#pragma once

#include "dynains/compiled_remover.hpp"
#include "dynains/pose.hpp"
#include "dynains/verdict.hpp"

namespace dynains {

/// Corrects the poses of an odometry by the static surfaces of earlier scans, and tells which
/// points move. The odometry itself goes on from its own poses.
template <class Stages = DefaultStages>
class BasicOdometryCorrector {
 public:
  using Remover = BasicDynaInsRemover<Stages>;
  using Config = typename Remover::Config;

  struct Result {
    /// Corrected pose, in the frame of the poses of the odometry. The pose of the first scan stays.
    Pose T_world_sensor = Pose::Identity();
    /// Labels, valid until the next call. `pose_residual` has the covariance of the motion, and is
    /// empty where the motion of the odometry stays. `began_epoch` gives the reason for that, if it
    /// is not the lack of common surfaces.
    FrameResult frame;
  };

  /// Throws ConfigError.
  explicit BasicOdometryCorrector(const Config& config = Config::odometry()) : remover_(config) {}

  /// Processes one scan. `cloud`: m, sensor frame. `T_odometry_sensor`: pose of the cloud by the
  /// odometry, without earlier corrections; it belongs to the cloud that is passed, so after
  /// de-skewing to the cloud that was de-skewed. `time`: s.
  ///
  /// Throws as BasicDynaInsRemover::push(). Such a scan is not taken: the next motion begins at the
  /// last scan that was taken.
  template <class Cloud, class PoseLike>
  Result correct(const Cloud& cloud, const PoseLike& T_odometry_sensor, double time) {
    const Pose T_odometry_newest = to_pose(T_odometry_sensor);
    Result result = {T_odometry_newest, remover_.push(cloud, T_odometry_newest, time)};
    if (result.frame.newest.scan > 0) {
      const auto& residual = result.frame.pose_residual;
      const Pose T_last_newest =
          residual ? residual->T_previous_newest
                   : detail::composed(detail::inverted(T_odometry_last_), T_odometry_newest);
      result.T_world_sensor = orthonormalized(detail::composed(T_world_last_, T_last_newest));
    }
    T_odometry_last_ = T_odometry_newest;
    T_world_last_ = result.T_world_sensor;
    return result;
  }

  /// The remover behind the poses, for its verdicts, sensor and configuration.
  Remover& remover() { return remover_; }

 private:
  Remover remover_;
  Pose T_odometry_last_ = Pose::Identity();  // of the last scan that was taken, as pushed
  Pose T_world_last_ = Pose::Identity();     // corrected
};

using OdometryCorrector = BasicOdometryCorrector<>;

}  // namespace dynains
