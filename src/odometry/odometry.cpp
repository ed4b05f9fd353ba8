#include "dynains/odometry/odometry.hpp"

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/surfaces/scan_registration.hpp"
#include "dynains/surfaces/way_search.hpp"
#include "scan_preparation.hpp"

namespace dynains {

using odometry::ScanPreparation;

void OdometryConfig::validate() const {
  validate_parameters("Odometry", *this);
  if (nearest < farthest) return;
  throw ConfigError("Odometry.nearest = " + std::to_string(nearest) +
                    " must be less than farthest = " + std::to_string(farthest));
}

namespace {

/// A pose, and the same turned in steps of 10 deg by up to 60 deg.
std::vector<Pose> turned(const Pose& T_map_near) {
  std::vector<Pose> poses = {T_map_near};
  for (int degrees = -60; degrees <= 60; degrees += 10) {
    if (degrees == 0) continue;
    poses.push_back(T_map_near *
                    Eigen::AngleAxisd(degrees * M_PI / 180.0, Eigen::Vector3d::UnitZ()));
  }
  return poses;
}

}  // namespace

class Odometry::Loop {
 public:
  Loop(const Config& config, const DynaInsRemover::Config& remover)
      : config_(config),
        remover_config_(remover),
        scan_(config.nearest, config.farthest, remover.sensors) {
    remover_config_.evidence.pose_tolerance = 0.0;  // the scan is registered here
  }

  OdometryResult push(const detail::CloudView& cloud, Span<const double> offsets, double time,
                      std::optional<Pose> T_odometry_sensor) {
    check(cloud, offsets);
    if (T_odometry_sensor) {
      validate_pose("T_odometry_sensor", *T_odometry_sensor);
      T_odometry_sensor = orthonormalized(*T_odometry_sensor);
    }
    scan_.take(cloud, offsets);
    const double mean_time = time + scan_.mean_offset();
    check_time(mean_time);
    const double period = scan_count_ > 0 ? mean_time - mean_time_ : 1.0;
    OdometryResult result;
    const Pose T_predicted = predicted_motion(period, T_odometry_sensor);
    Pose T_last_newest = T_predicted;
    result.loss = register_scan(period, T_last_newest, result);
    const bool is_lost = result.loss != OdometryLoss::kNone;
    if (!is_lost) fit_before_ = result.fit;
    const bool is_taken = !is_lost || T_odometry_sensor || result.loss == OdometryLoss::kGap;
    if (is_lost && is_taken) {
      T_last_newest = T_predicted;
      scan_.prepare(T_last_newest, period);
      if (result.loss != OdometryLoss::kFewPoints) begin_map();
    }
    const double stamp = 1.0 - scan_.mean_offset() / period;  // 0: last scan, 1: this one
    if (first_ && is_taken) {
      const double first_stamp = -first_->mean_offset() / period;
      const Pose T_world_start = detail::scaled_motion(T_last_newest, first_stamp);
      T_result_world_ = T_result_world_ * T_world_start.inverse();
    }
    if (scan_count_ > 0) {
      result.T_world_sensor =
          T_result_world_ * T_world_last_ * detail::scaled_motion(T_last_newest, stamp);
    } else if (T_odometry_sensor) {
      T_result_world_ = result.T_world_sensor = *T_odometry_sensor;
    }
    if (!is_taken) return result;
    if (T_odometry_sensor) T_odometry_last_ = *T_odometry_sensor;
    take(T_last_newest, period, mean_time, result);
    return result;
  }

 private:
  static void check(const detail::CloudView& cloud, Span<const double> offsets) {
    if (offsets.empty() || offsets.size() == cloud.size()) return;
    throw CloudError(std::to_string(offsets.size()) + " offsets for " +
                     std::to_string(cloud.size()) + " points; expected one for each, or none");
  }

  void check_time(double mean_time) const {
    if (std::isfinite(mean_time) && (scan_count_ == 0 || mean_time > mean_time_)) return;
    throw PoseError("time " + std::to_string(mean_time) + " s must be finite and after " +
                    std::to_string(mean_time_) + " s");
  }

  /// That of another odometry, or at constant velocity.
  Pose predicted_motion(double period, const std::optional<Pose>& T_odometry_sensor) const {
    if (T_odometry_sensor && scan_count_ > 0)
      return T_odometry_last_.inverse() * *T_odometry_sensor;
    if (period_ <= 0.0) return Pose::Identity();
    return detail::scaled_motion(T_last_newest_, period / period_);
  }

  bool are_scans_missing(double period) const { return period_ > 0.0 && period > 1.5 * period_; }

  /// The first motion is not predicted, and neither is what happens while scans are missing.
  bool is_predictable(double period) const { return !first_ && !are_scans_missing(period); }

  bool is_after_gap(double period) const {
    return period > kMaxPeriod && are_scans_missing(period);
  }

  /// Whether the newest scan fits to the map as registrations of other places hardly do. How well
  /// scans fit at all depends on the pattern of their points.
  bool is_overlap(double fit) const {
    constexpr double kMin = 0.6;  // ratio
    return fit >= kMin || fit >= kMin * scan_.expected_fit();
  }

  /// The predicted place, but not the predicted turn: a sensor that is carried by hand turns to and
  /// fro.
  Pose without_turn(Pose T_map_predicted) const {
    T_map_predicted.linear() = T_world_last_.linear();
    return T_map_predicted;
  }

  /// Sums of the weights of points on planes.
  struct PlaneWeights {
    double all = 0.0;
    double across = 0.0;  ///< on planes whose normals lie along a direction
  };

  /// Poles do not count: columns of beams on smooth walls look like them, and move with the sensor.
  PlaneWeights weights_on_planes(const Pose& T_map_scan, const Eigen::Vector3d& direction) const {
    constexpr double kAlong = 0.8;  // cosine
    PlaneWeights sums;
    for (const Eigen::Vector3d& p : scan_.keypoints()) {
      const Eigen::Vector3d place = T_map_scan * p;
      const CellSurface* const surface = map_.find(kCellLevels - 1, place);
      if (surface == nullptr || surface->direction_count != 1) continue;
      const double weight = detail::robust_weight(surface->squared_distance(place), 0.1);  // m
      sums.all += weight;
      if (std::abs(surface->directions[0].dot(direction)) >= kAlong) sums.across += weight;
    }
    return sums;
  }

  /// Whether the scan is held along the direction that surfaces determine worst: by planes across
  /// it, or because it fits clearly worse on both sides of its place. The scatter of smooth walls
  /// seems to determine a motion along them, where any fits nearly as well.
  bool is_held(const Registration& found) const {
    constexpr double kMinAcross = 0.05;  // ratio of the weights
    constexpr double kAside = 2.0;       // m, more than patterns of beams on surfaces are wide
    constexpr double kAsGood = 0.75;     // ratio of the weights
    const Eigen::Vector3d& direction = found.uncertain[0];
    const PlaneWeights here = weights_on_planes(found.T_a_b, direction);
    if (here.across > kMinAcross * here.all) return true;
    const auto is_worse_at = [&](double way) {
      Pose T_beside = found.T_a_b;
      T_beside.translation() += way * direction;
      return weights_on_planes(T_beside, direction).all < kAsGood * here.all;
    };
    return is_worse_at(kAside) && is_worse_at(-kAside);
  }

  /// De-skewing needs the motion, which needs de-skewed points: both in turn.
  OdometryLoss register_scan(double period, Pose& T_last_newest, OdometryResult& result) {
    constexpr int kMaxTurns = 4;
    constexpr double kConverged = 0.02;  // m
    constexpr double kPoor = 0.8;        // ratio to the fit of the scan before
    for (int turn = 0; turn < kMaxTurns; ++turn) {
      scan_.prepare(T_last_newest, period);
      const std::vector<Eigen::Vector3d>& points = scan_.keypoints();
      if (points.size() < kMinMatches) return OdometryLoss::kFewPoints;
      if (scan_count_ == 0) return OdometryLoss::kNone;
      if (is_after_gap(period)) return OdometryLoss::kGap;
      if (first_) start_map(T_last_newest, period);
      const Pose T_predicted = T_world_last_ * T_last_newest;
      std::optional<Registration> best;
      if (turn > 0 || is_predictable(period)) best = register_near(map_, points, T_predicted);
      if (turn == 0 && (!best || best->score < kPoor * fit_before_ || !is_overlap(best->score))) {
        const auto other = register_scans(map_, points, turned(without_turn(T_predicted)));
        if (other && (!best || best->score < kAlmost * other->score)) best = other;
      }
      if (first_ && turn == 0 && best) search_first_motion(*best, period);
      result.fit = best ? best->score : 0.0;
      if (!is_overlap(result.fit)) return OdometryLoss::kNoOverlap;
      result.free_directions = best->free_directions;
      if (result.free_directions == 0 && !is_held(*best)) result.free_directions = 1;
      const Pose T_last_before = T_last_newest;
      T_last_newest = T_world_last_.inverse() * best->T_a_b;
      if (scan_.has_one_time() || extent_of(T_last_before.inverse() * T_last_newest) < kConverged) {
        break;
      }
    }
    return OdometryLoss::kNone;
  }

  /// Traffic that moves with the sensor fits without a motion. Then landmarks determine the way
  /// along the direction that surfaces determine worst.
  void search_first_motion(Registration& best, double period) {
    const Landmarks first = first_->landmarks(), second = scan_.landmarks();
    const auto found = register_along(map_, scan_.keypoints(), first, second, best.T_a_b,
                                      best.uncertain[0], longest_way(period));
    if (found && mean_gap(first, second, found->T_a_b) < mean_gap(first, second, best.T_a_b)) {
      best = *found;
    }
  }

  void begin_map() {
    map_scale_ = scan_.scale();
    map_ = SurfaceGrid(true, map_scale_);
  }

  /// The map of the first scan, whose motion is that until the second one.
  void start_map(const Pose& T_first_second, double period) {
    begin_map();
    first_->prepare(T_first_second, period);
    for (const ScanPreparation::Point& point : first_->map_points()) map_.insert(point.position);
  }

  /// Judges the scan, adds it to the map, and is ready for the next one.
  void take(const Pose& T_last_newest, double period, double mean_time, OdometryResult& result) {
    T_world_last_ = orthonormalized(T_world_last_ * T_last_newest);
    if (config_.remove) {
      if (scan_count_ < 2) remover_.emplace(remover_config_);
      if (first_) remover_->push(first_->cloud(), Pose::Identity(), mean_time_);
      result.frame = remover_->push(scan_.cloud(), T_world_last_, mean_time);
    }
    scan_.adapt();
    if (scan_count_ == 0) {
      first_ = scan_;
    } else {
      if (map_scale_ != scan_.scale()) begin_map();
      add_to_map(result.frame.newest().labels);
      first_.reset();
      T_last_newest_ = T_last_newest;
      period_ = period;
    }
    mean_time_ = mean_time;
    ++scan_count_;
  }

  void add_to_map(Span<const PointLabel> labels) {
    map_.begin_scan(T_world_last_ * scan_.centre());
    for (const ScanPreparation::Point& point : scan_.map_points()) {
      if (!labels.empty() && labels[point.index] == PointLabel::kDynamic) continue;
      map_.insert(T_world_last_ * point.position);
    }
    const Eigen::Vector3d& centre = T_world_last_.translation();
    if ((centre - centre_).norm() < 0.1 * config_.farthest) return;
    map_.forget_beyond(centre, 1.1 * config_.farthest);
    centre_ = centre;
  }

  // Poses of scans are those at the mean time of their points. The frame `world` is the first one.
  Config config_;
  DynaInsRemover::Config remover_config_;
  ScanPreparation scan_;
  std::optional<ScanPreparation> first_;  // until the motion of the first scan is known
  SurfaceGrid map_{true};
  double map_scale_ = 1.0;
  std::optional<DynaInsRemover> remover_;
  Pose T_result_world_ = Pose::Identity();
  Pose T_odometry_last_ = Pose::Identity();
  Pose T_world_last_ = Pose::Identity();
  Pose T_last_newest_ = Pose::Identity();
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();  // m, of the map
  double mean_time_ = 0.0;                            // s, of the last scan
  double period_ = 0.0;                               // s, of T_last_newest_; 0: not known
  double fit_before_ = 0.0;                           // of the last scan that is not lost
  std::size_t scan_count_ = 0;
};

Odometry::Odometry(const Config& config, const DynaInsRemover::Config& remover) {
  config.validate();
  remover.validate();
  loop_ = std::make_unique<Loop>(config, remover);
}
Odometry::Odometry(Odometry&&) noexcept = default;
Odometry& Odometry::operator=(Odometry&&) noexcept = default;
Odometry::~Odometry() = default;

OdometryResult Odometry::register_scan(const detail::CloudView& cloud, Span<const double> offsets,
                                       double time, const std::optional<Pose>& T_odometry_sensor) {
  return loop_->push(cloud, offsets, time, T_odometry_sensor);
}

}  // namespace dynains
