// Poses by which the first pass has compared the scans of a recording.
#pragma once

#include <cstdint>
#include <vector>

#include "dynains/pose.hpp"
#include "dynains/verdict.hpp"

namespace dynains {

struct ComparedPose {
  Pose T_world_sensor = Pose::Identity();  ///< as pushed, or with the corrections of its epoch
  bool begins_epoch = false;               ///< the scan is not compared with earlier ones
  bool is_suspicious = false;              ///< scans do not fit to each other, see Plausibility
};

/// Chains the corrected motions of pushes. An epoch begins at the pushed pose.
class ComparedPoses {
 public:
  /// Takes the result of the next push.
  void add(const FrameResult& frame) {
    const Pose& T_pushed = frame.newest.T_world_sensor;
    ComparedPose next = {T_pushed, poses_.empty() || frame.began_epoch.has_value(),
                         frame.plausibility.suspicion != Suspicion::kNone};
    if (!next.begins_epoch && frame.pose_residual) {
      constexpr double kRounding = 1e-6;  // m, and rad
      const Pose T = orthonormalized(
          Pose(poses_.back().T_world_sensor * frame.pose_residual->T_previous_newest));
      const double change = (T.matrix() - T_pushed.matrix()).cwiseAbs().maxCoeff();
      if (change > kRounding) next.T_world_sensor = T;
    } else if (!next.begins_epoch) {
      const Pose T_correction = poses_.back().T_world_sensor * T_pushed_.inverse();
      next.T_world_sensor = orthonormalized(Pose(T_correction * T_pushed));
    }
    T_pushed_ = T_pushed;
    poses_.push_back(next);
  }

  /// By the number of the scan.
  const ComparedPose& operator[](std::uint64_t scan) const { return poses_[scan]; }

 private:
  Pose T_pushed_ = Pose::Identity();  // the newest one
  std::vector<ComparedPose> poses_;
};

}  // namespace dynains
