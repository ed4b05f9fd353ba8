#include "dynains/odometry/odometry.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dynains/compiled_remover.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/trajectory.hpp"
#include "local_map.hpp"
#include "registration.hpp"
#include "scan_preparation.hpp"

namespace dynains {

using odometry::Alignment;
using odometry::LocalMap;
using odometry::ScanPreparation;

void OdometryConfig::validate() const {
  validate_parameters("Odometry", *this);
  if (nearest < farthest) return;
  throw ConfigError("Odometry.nearest = " + std::to_string(nearest) +
                    " must be less than farthest = " + std::to_string(farthest));
}

class Odometry::Loop {
 public:
  explicit Loop(const Config& config)
      : config_(config), preparation_(config.nearest, config.farthest) {
    if (config.remove) remover_.emplace(DynaInsRemover::Config::odometry());
  }

  OdometryResult push(RawPoints<float> points, Span<const double> offsets, double time) {
    const Pose T_last_predicted = predicted_motion(time);
    preparation_.prepare(points, offsets, T_last_newest_, period_);
    OdometryResult result;
    const Pose T_predicted = T_world_last_ * T_last_predicted;
    result.T_world_sensor = T_predicted;
    result.loss = register_scan(T_predicted, result);
    if (result.loss != OdometryLoss::kNone) return result;
    result.T_world_sensor = orthonormalized(result.T_world_sensor);
    if (remover_) {
      const RawPoints<float> cloud = preparation_.cloud();
      result.labels = remover_->push(cloud, result.T_world_sensor, time).newest.labels;
    }
    note_prediction(T_predicted.inverse() * result.T_world_sensor);
    add_to_map(result.T_world_sensor, result.labels);
    T_last_newest_ = T_world_last_.inverse() * result.T_world_sensor;
    period_ = scan_count_ > 0 ? time - time_ : 0.0;
    time_ = time;
    preparation_.adapt();
    ++scan_count_;
    T_world_last_ = result.T_world_sensor;
    return result;
  }

  void check(RawPoints<float> points, Span<const double> offsets, double time) const {
    const std::size_t count = PointCloudTraits<RawPoints<float>>::size(points);
    if (!offsets.empty() && offsets.size() != count) {
      throw CloudError(std::to_string(offsets.size()) + " offsets for " + std::to_string(count) +
                       " points; expected one for each, or none");
    }
    if (std::isfinite(time) && (scan_count_ == 0 || time > time_)) return;
    throw PoseError("time " + std::to_string(time) + " s must be finite and after " +
                    std::to_string(time_) + " s");
  }

 private:
  /// At constant velocity; a long pause tells nothing of the velocity.
  Pose predicted_motion(double time) const {
    constexpr double kLongestPause = 1.0;  // s
    if (period_ <= 0.0 || time - time_ > kLongestPause) return Pose::Identity();
    return extrapolate(Pose::Identity(), T_last_newest_, (time - time_) / period_);
  }

  OdometryLoss register_scan(const Pose& T_predicted, OdometryResult& result) {
    constexpr std::size_t kFewest = 100;  // points
    constexpr double kLeastFit = 0.2;
    // m. The surfaces of a few scans are rough.
    constexpr double kFirst = 0.8, kDecay = 0.9, kFinest = 0.1;
    if (preparation_.keypoints().size() < kFewest) return OdometryLoss::kFewPoints;
    if (map_.empty()) return OdometryLoss::kNone;
    const std::vector<Eigen::Vector3d>& points = preparation_.keypoints();
    const double finest =
        std::max(kFinest, kFirst * std::pow(kDecay, static_cast<double>(scan_count_)));
    Alignment best = align(points, map_, T_predicted, 3.0 * expected_error_, finest);
    // The first motion is not predicted.
    if (period_ <= 0.0 || best.fit < kLeastFit) {
      const Alignment found = search(points, map_, T_world_last_, finest);
      if (found.score > best.score) best = found;
    }
    result.fit = best.fit;
    result.free_directions = best.free_directions;
    if (best.fit < kLeastFit) return OdometryLoss::kNoOverlap;
    result.T_world_sensor = best.T_map_scan;
    return OdometryLoss::kNone;
  }

  /// Running mean of the errors of predictions.
  void note_prediction(const Pose& T_predicted_found) {
    constexpr double kShare = 0.1, kArm = 10.0;  // m
    if (period_ <= 0.0) return;
    const Eigen::Matrix3d R = T_predicted_found.linear();
    const Eigen::Vector3d axis(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
    const double turn = std::atan2(axis.norm(), R.trace() - 1.0);  // rad
    const double error = T_predicted_found.translation().norm() + kArm * turn;
    expected_error_ += kShare * (error - expected_error_);
  }

  void add_to_map(const Pose& T_world_sensor, Span<const PointLabel> labels) {
    constexpr double kForget = 0.1;  // of the reach
    for (const ScanPreparation::Point& point : preparation_.map_points()) {
      if (!labels.empty() && labels[point.index] == PointLabel::kDynamic) continue;
      map_.insert(T_world_sensor * point.position);
    }
    const Eigen::Vector3d& centre = T_world_sensor.translation();
    if ((centre - centre_).norm() < kForget * config_.farthest) return;
    map_.forget_beyond(centre, 1.1 * config_.farthest);
    centre_ = centre;
  }

  Config config_;
  ScanPreparation preparation_;
  LocalMap map_;
  std::optional<DynaInsRemover> remover_;
  Pose T_world_last_ = Pose::Identity();
  Pose T_last_newest_ = Pose::Identity();
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();  // m, of the map
  double expected_error_ = 0.5;                       // m, of predictions
  double time_ = 0.0;                                 // s
  double period_ = 0.0;                               // s, 0: one scan or none
  std::size_t scan_count_ = 0;
};

Odometry::Odometry(const Config& config) {
  config.validate();
  loop_ = std::make_unique<Loop>(config);
}
Odometry::Odometry(Odometry&&) noexcept = default;
Odometry& Odometry::operator=(Odometry&&) noexcept = default;
Odometry::~Odometry() = default;

OdometryResult Odometry::push(RawPoints<float> points, Span<const double> offsets, double time) {
  loop_->check(points, offsets, time);
  return loop_->push(points, offsets, time);
}

}  // namespace dynains
