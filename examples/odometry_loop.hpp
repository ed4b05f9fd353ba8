// The loop of docs/embedding.md: any odometry, with its poses refined by dynains.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <dynains/compiled_remover.hpp>
#include <functional>
#include <utility>
#include <vector>

namespace odometry_loop {

using Points = std::vector<Eigen::Vector3d>;  // m, sensor frame

/// An odometry: registers the next scan and returns its pose in the frame of the first scan.
using Register = std::function<Eigen::Isometry3d(const Points& scan)>;

/// An odometry with dynains behind it.
class RefinedOdometry {
 public:
  struct Result {
    Eigen::Isometry3d T_world_sensor;  ///< refined pose
    dynains::FrameResult frame;        ///< verdicts; valid until the next scan
  };

  explicit RefinedOdometry(Register odometry)
      : odometry_(std::move(odometry)), remover_(dynains::DynaInsRemover::Config::odometry()) {}

  /// Takes the next scan. `time`: s.
  Result push(const Points& scan, double time) {
    // 1. Register all points.
    const Eigen::Isometry3d T_odometry = odometry_(scan);
    Eigen::Isometry3d T_last_newest = T_odometry_last_.inverse() * T_odometry;
    T_odometry_last_ = T_odometry;

    // 2. Push the scan with the pose of the odometry, not with the refined one: the remover
    // remembers its corrections, and would apply them twice.
    const dynains::FrameResult frame = remover_.push(scan, T_odometry, time);

    // 3. Take the corrected motion. Without common surfaces there is none.
    if (frame.pose_residual) T_last_newest = frame.pose_residual->T_previous_newest;
    T_world_last_ = T_world_last_ * T_last_newest;
    return {T_world_last_, frame};
  }

 private:
  Register odometry_;
  dynains::DynaInsRemover remover_;
  Eigen::Isometry3d T_odometry_last_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_world_last_ = Eigen::Isometry3d::Identity();
};

}  // namespace odometry_loop
