// Correction of poses for the comparison of scans, by registration of static surfaces.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/registration/motion_stage.hpp"
#include "dynains/registration/plane_aligner.hpp"
#include "dynains/registration/voxel_planes.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/verdict.hpp"

namespace dynains::detail {

/// Extrapolates the motion of a sensor, and recognizes motions that no sensor makes.
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
    const double ratio = std::min(period_ / period_before_, kMaxRatio);
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
  static constexpr double kMaxRatio = 10.0;

  // Distance (m) from the predicted pose that the strongest acceleration explains.
  double reached() const { return kAcceleration * period_ * 0.5 * (period_ + period_before_); }

  std::optional<Pose> T_before_newest_;
  std::optional<Pose> T_rejected_;  // motion of the scan before, if it was rejected
  double time_ = 0.0, period_ = 0.0, period_before_ = 0.0;  // s
  double usual_ = 0.0;                                      // m, of the distances
};

/// Aligns each scan with the planes of earlier scans of its epoch. If a pose is inexact, so that
/// static surfaces of the scan lie too far from the planes, it is replaced by the aligned pose.
/// Directions in which the planes do not support the correction stay as they were pushed. Later
/// poses begin with the correction. Exact poses stay, bit by bit.
class PoseCorrection final : public MotionStage {
 public:
  /// `tolerance`: root mean square distance (m) between static surfaces up to which a pose stays.
  explicit PoseCorrection(double tolerance) : tolerance_(tolerance) {}

  void begin_epoch(const Pose& T_world_level) override {
    motion_.clear();
    aligner_.clear();
    is_exact_ = true;
    begin_planes(T_world_level);
  }

  Pose correct(const Pose& T_world_level, const GroundSplit& split,
               const std::optional<double>& time) override {
    residual_.reset();
    misfit_.reset();
    const Pose T_pushed = composed(T_origin_world_, T_world_level);
    const Pose T_guess = correction_ ? composed(*correction_, T_pushed) : T_pushed;
    Pose T_newest = T_guess;
    motion_.begin_scan(time);
    if (has_planes_) {
      select_points(split, selected_);
      align(T_pushed, T_guess, T_newest);
      check_motion(T_newest);
    }
    if (misfit_) {
      begin_planes(T_world_level);
      return T_world_level;
    }
    T_origin_newest_ = T_newest;
    T_origin_pushed_ = T_pushed;
    return corrected(T_world_level);
  }

  Pose corrected(const Pose& T_world_frame) const override {
    if (!correction_) return T_world_frame;
    return composed(T_world_origin_,
                    composed(*correction_, composed(T_origin_world_, T_world_frame)));
  }

  void insert(const Pose& T_world_level, const GroundSplit& split,
              Span<const std::uint8_t> moving) override {
    const Pose T = composed(T_origin_world_, T_world_level);
    has_planes_ = true;
    planes_.begin_scan(T);
    with_packs([&](auto) {
      VoxelPlanes::Block block;
      visit_some(split, kInserted, [&](std::size_t i, double x, double y, double z) {
        const bool is_object = i >= split.ground_count;
        if (is_object && !moving.empty() && moving[i - split.ground_count] != 0) return;
        block.push_back(x, y, z);
        if (block.is_full()) planes_.add(block);
      });
      planes_.add(block);
    });
  }

  const std::optional<PoseResidual>& residual() const override { return residual_; }
  const std::optional<EpochReason>& misfit() const override { return misfit_; }

 private:
  static constexpr std::size_t kInserted = 12000;  // points of a scan
  static constexpr std::size_t kMinMatches = 100;
  static constexpr double kMinInliers = 0.5;  // ratio to the matches

  // Begins with a scan without planes. The motion goes on.
  void begin_planes(const Pose& T_world_level) {
    planes_.clear();
    has_planes_ = false;
    T_world_origin_ = T_world_level;
    T_origin_world_ = inverted(T_world_level);
    T_origin_newest_ = Pose::Identity();
    T_origin_pushed_ = Pose::Identity();
    correction_.reset();
    residual_.reset();
  }

  // Aligns the newest scan from its pose `T_guess` with the correction so far, and writes
  // `T_newest`.
  void align(const Pose& T_pushed, const Pose& T_guess, Pose& T_newest) {
    const Alignment alignment = aligner_.align(selected_, planes_, T_guess, is_exact_);
    if (alignment.matched < kMinMatches) return;
    if (static_cast<double>(alignment.inliers) <
        kMinInliers * static_cast<double>(alignment.matched)) {
      misfit_ = EpochReason::kMisfit;
      return;
    }
    const Pose T_aligned = moved(T_guess, alignment.supported);
    if (alignment.change > tolerance_) {
      is_exact_ = false;
      T_newest = T_aligned;
      correction_ = composed(T_newest, inverted(T_pushed));
    }
    const Pose T_motion = composed(inverted(T_origin_pushed_), T_pushed);
    residual_ = difference(composed(T_origin_newest_, T_motion), T_aligned);
    const Pose T_previous_origin = inverted(T_origin_newest_);
    residual_->T_previous_newest = composed(T_previous_origin, T_newest);
    const Pose T_found = moved(T_guess, alignment.found);
    residual_->T_previous_aligned = composed(T_previous_origin, T_found);
    set_covariance(alignment.covariance, T_found);
  }

  // Writes the covariance of an alignment, along the axes of the map, to the residual.
  void set_covariance(const PoseCovariance& covariance, const Pose& T_origin_sensor) {
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < 6; ++j) residual_->covariance[6 * i + j] = covariance[i][j];
    }
    Pose R_sensor_origin = Pose::Identity();
    R_sensor_origin.linear() = T_origin_sensor.linear().transpose();
    residual_->covariance = transported_covariance(residual_->covariance, R_sensor_origin);
  }

  // Compares the pose of the newest scan with the one that the motion predicts. If only the
  // predicted one fits to the upright surfaces, or none is possible, the pose has jumped. (Ground
  // fits anywhere.)
  void check_motion(const Pose& T_newest) {
    constexpr double kNear = 0.1, kNearDegrees = 0.5;  // m, deg
    constexpr double kMinPoints = 8.0;                 // see PlaneAligner::upright_fit()
    constexpr double kMinRatio = 0.7;
    const Pose T_motion = composed(inverted(T_origin_newest_), T_newest);
    const std::optional<Pose> T_predicted = motion_.predict(T_origin_newest_);
    const PoseResidual error = T_predicted ? difference(*T_predicted, T_newest) : PoseResidual();
    const bool is_impossible = motion_.is_impossible(error.translation);
    bool has_jumped = is_impossible && !motion_.repeats_rejected(T_motion);
    if (!has_jumped && (error.translation > kNear || error.rotation > kNearDegrees)) {
      const double expected = aligner_.upright_fit(selected_, planes_, *T_predicted);
      has_jumped = expected > kMinPoints &&
                   aligner_.upright_fit(selected_, planes_, T_newest) < kMinRatio * expected;
    }
    if (has_jumped) misfit_ = EpochReason::kJump;
    if (misfit_) {
      residual_.reset();
      motion_.reject_scan(T_motion);
    } else {
      motion_.end_scan(T_motion, is_impossible ? 0.0 : error.translation);
    }
  }

  // Rotation and translation of the sensor from one pose to another.
  static PoseResidual difference(const Pose& T_map_a, const Pose& T_map_b) {
    const Pose T_a_b = composed(inverted(T_map_a), T_map_b);
    const double x = T_a_b(2, 1) - T_a_b(1, 2);
    const double y = T_a_b(0, 2) - T_a_b(2, 0);
    const double z = T_a_b(1, 0) - T_a_b(0, 1);
    const double sine = 0.5 * std::sqrt(x * x + y * y + z * z);  // of an angle below 90 deg
    PoseResidual residual;
    residual.translation = distance(T_map_a, T_map_b);
    residual.rotation = std::asin(std::min(sine, 1.0)) * 180.0 / M_PI;
    return residual;
  }

  double tolerance_;
  VoxelPlanes planes_;       // in the origin frame: the first scan of the epoch
  bool has_planes_ = false;  // whether a scan was inserted
  Pose T_world_origin_ = Pose::Identity();
  Pose T_origin_world_ = Pose::Identity();
  std::optional<Pose> correction_;           // in the origin frame, multiplied from the left
  Pose T_origin_newest_ = Pose::Identity();  // corrected
  Pose T_origin_pushed_ = Pose::Identity();  // as pushed
  std::optional<PoseResidual> residual_;
  std::optional<EpochReason> misfit_;
  MotionPrediction motion_;
  bool is_exact_ = true;  // whether all poses of the epoch are presumed to be exact
  PointBuffer selected_;
  PlaneAligner aligner_;
};

}  // namespace dynains::detail
