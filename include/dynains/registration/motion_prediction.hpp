// Prediction of the next pose from the motion so far.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <optional>

#include "dynains/pose.hpp"

namespace dynains::detail {

/// Continues the motion of a sensor, and tells motions that no sensor makes.
class MotionPrediction {
 public:
  /// Forgets all poses and times.
  void clear() { *this = MotionPrediction(); }

  /// Begins a scan at a time (s), or at kPeriod after the scan before if it has none.
  void begin_scan(const std::optional<double>& time) {
    const double now = time ? *time : time_ + kPeriod;
    period_before_ = period_;
    period_ = now - time_;
    time_ = now;
  }

  /// Pose of the scan if the motion went on, from the pose of the scan before. Empty if no motion
  /// is known.
  std::optional<Pose> predict(const Pose& T_map_before) const {
    if (!T_before_newest_ || !(period_before_ > 0.0)) return std::nullopt;
    const double ratio = std::min(period_ / period_before_, kMostRatio);
    return composed(T_map_before, scaled_motion(*T_before_newest_, ratio));
  }

  /// Whether a distance (m) from the predicted pose needs an acceleration that no sensor has, and
  /// is an outlier of the distances before it.
  bool is_impossible(double distance) const {
    return distance > kSlack + reached() && distance > kOutlier * usual_;
  }

  /// Whether a motion goes on from the one that was rejected at the scan before. Two motions that
  /// agree are right, and the prediction was wrong: an odometry often begins with one that is.
  bool repeats_rejected(const Pose& T_before_newest) const {
    if (!T_rejected_ || !(period_before_ > 0.0)) return false;
    const Pose T_repeated = scaled_motion(*T_rejected_, period_ / period_before_);
    return distance(T_repeated, T_before_newest) <= kSlack + reached();
  }

  /// Ends a scan that does not fit to earlier ones. The prediction stays.
  void reject_scan(const Pose& T_before_newest) { T_rejected_ = T_before_newest; }

  /// Ends a scan. `distance`: from the predicted pose, m; 0 without one.
  void end_scan(const Pose& T_before_newest, double distance) {
    constexpr double kNewest = 0.1;  // weight
    T_before_newest_ = T_before_newest;
    T_rejected_.reset();
    usual_ += kNewest * (distance - usual_);
  }

 private:
  static constexpr double kPeriod = 0.1;         // s
  static constexpr double kAcceleration = 40.0;  // m/s^2
  static constexpr double kSlack = 0.1;          // m
  static constexpr double kOutlier = 5.0;        // ratio to the usual distance
  static constexpr double kMostRatio = 10.0;

  // Distance (m) from the predicted pose that the strongest acceleration explains.
  double reached() const { return kAcceleration * period_ * 0.5 * (period_ + period_before_); }

  std::optional<Pose> T_before_newest_;
  std::optional<Pose> T_rejected_;  // motion of the scan before, if it was rejected
  double time_ = 0.0, period_ = 0.0, period_before_ = 0.0;  // s
  double usual_ = 0.0;                                      // m, of the distances
};

}  // namespace dynains::detail
