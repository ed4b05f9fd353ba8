// The work of a node: clouds wait for their poses, are cleaned in order, and are counted. Without
// types of ROS.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <exception>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dynains/adapters/point_cloud2.hpp"
#include "dynains/compiled_remover.hpp"
#include "dynains/odometry/odometry.hpp"
#include "ros_common/cloud_queue.hpp"
#include "ros_common/loop_report.hpp"
#include "ros_common/point_times.hpp"

namespace dynains_ros {

/// The result for one cloud.
struct Cleaned {
  dynains::Span<const dynains::PointLabel> labels;  ///< of its points; empty: it is not judged
  std::optional<dynains::Pose> T_odom_sensor;       ///< by the own odometry, if it has track
  const dynains::FrameResult& frame;
};

/// `CloudPtr` points to a PointCloud2 message. add() and report() may be called by any thread, the
/// other functions by one thread. Times are in seconds.
template <class CloudPtr>
class RemoverLoop {
 public:
  struct Config {
    double patience = 0.2;      ///< s, how long a cloud waits for its pose
    std::size_t capacity = 10;  ///< clouds that wait
    double map_period = 2.0;    ///< s, between two maps
    bool odometry = false;      ///< poses are those of dynains::Odometry, and there is no map
  };

  /// Throws dynains::ConfigError.
  RemoverLoop(const dynains::DynaInsRemover::Config& remover, const Config& config)
      : remover_config_(remover), config_(config), queue_(config.patience, config.capacity) {
    start();
  }

  /// Lets a cloud wait for its pose. Returns whether the time jumped backwards: the caller forgets
  /// its transforms, and the remover starts anew with this cloud.
  bool add(CloudPtr cloud, double now) {
    const double stamp = dynains::message_time(*cloud);
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_.arrived;
    const bool has_jumped =
        queue_.add(std::move(cloud), stamp, now, [this](Drop reason) { count(reason); });
    if (has_jumped) {
      must_reset_ = true;
      ++totals_.resets;
    }
    return has_jumped;
  }

  bool is_waiting() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return !queue_.empty();
  }

  /// How long to wait for new clouds or poses before the next call of clean_next(), which has just
  /// returned `has_cleaned`.
  std::chrono::milliseconds pause_after(bool has_cleaned) const {
    constexpr std::chrono::milliseconds kForPose{5}, kForCloud{50};
    if (has_cleaned) return std::chrono::milliseconds::zero();
    return is_waiting() ? kForPose : kForCloud;
  }

  /// Cleans the oldest cloud if its pose is known, and calls `publish(cloud, cleaned)`.
  /// `find_pose`: see CloudQueue::take(); it is not called with Config::odometry. Returns whether a
  /// cloud was taken. `now`: by the clock of the stamps.
  template <class FindPose, class Publish>
  bool clean_next(double now, FindPose&& find_pose, Publish&& publish) {
    const auto next = take(now, find_pose);
    if (!next) return false;
    const auto begin = std::chrono::steady_clock::now();
    const auto seconds = [begin] {
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    };
    dynains::FrameResult frame;
    std::optional<dynains::Pose> T_odom_sensor;
    try {
      const dynains::PointCloud2View points(*next->cloud);
      if (remover_) frame = remover_->push(points, next->T_fixed_sensor, next->stamp);
      if (odometry_) T_odom_sensor = register_cloud(*next->cloud, points, next->stamp, frame);
    } catch (const std::exception& error) {
      const std::lock_guard<std::mutex> lock(mutex_);
      count(Drop::kInvalid, error.what());
      return true;
    }
    attempt([&] { publish(next->cloud, Cleaned{frame.newest().labels, T_odom_sensor, frame}); });
    count(frame, seconds(), now - next->stamp);
    return true;
  }

  /// Calls `publish(map)` if somebody reads maps, the map has changed and the last one is old
  /// enough. `now`: of a clock that never jumps.
  template <class Publish>
  void publish_map(double now, bool has_readers, Publish&& publish) {
    const bool has_changed = remover_ && remover_->map().size() != map_points_;
    if (!has_readers || !has_changed || now < next_map_) return;
    map_points_ = remover_->map().size();
    next_map_ = now + config_.map_period;
    attempt([&] { publish(remover_->map()); });
  }

  /// Calls `publish()`. A message that cannot be published costs no more than itself. For any
  /// thread.
  template <class Publish>
  void attempt(Publish&& publish) {
    try {
      publish();
    } catch (const std::exception&) {
      const std::lock_guard<std::mutex> lock(mutex_);
      ++counts_.failures;
    }
  }

  /// Report since the last one, `seconds` ago; starts a new period.
  Diagnosis report(double seconds) {
    const std::lock_guard<std::mutex> lock(mutex_);
    state_.waiting = queue_.size();
    return diagnose(std::exchange(counts_, LoopCounts()), totals_, state_, seconds);
  }

 private:
  template <class FindPose>
  auto take(double now, FindPose&& find_pose) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (std::exchange(must_reset_, false)) start();
    const auto on_drop = [this](Drop reason, const std::string& text) { count(reason, text); };
    if (!config_.odometry) return queue_.take(now, find_pose, on_drop);
    const auto no_pose = [](const CloudPtr&) {
      return PoseAnswer{dynains::Pose::Identity(), true, ""};
    };
    return queue_.take(now, no_pose, on_drop);
  }

  /// Begins without a past.
  void start() {
    state_ = LoopState();
    if (config_.odometry) {
      odometry_.emplace(dynains::Odometry::Config(), remover_config_);
    } else {
      remover_.emplace(remover_config_);
    }
    T_odom_start_ = T_odom_last_;
  }

  /// The pose of a cloud by the odometry, and what it removes; none after a loss. An odometry that
  /// stays lost, or that clouds are missing for, begins anew where it was.
  template <class Cloud>
  std::optional<dynains::Pose> register_cloud(const Cloud& cloud,
                                              const dynains::PointCloud2View& points, double stamp,
                                              dynains::FrameResult& frame) {
    constexpr int kMaxLost = 5;  // clouds
    const std::vector<double> offsets = point_offsets(cloud, stamp);
    dynains::OdometryResult result = odometry_->push(points, offsets, stamp);
    if (result.loss == dynains::OdometryLoss::kNone) {
      lost_ = 0;
      frame = std::move(result.frame);
      T_odom_last_ = T_odom_start_ * result.T_world_sensor;
      return T_odom_last_;
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_.lost;
    counts_.loss = dynains::value_names(result.loss)[static_cast<std::size_t>(result.loss)];
    if (result.loss == dynains::OdometryLoss::kGap || ++lost_ >= kMaxLost) start();
    return std::nullopt;
  }

  void count(Drop reason, const std::string& text = "") {
    ++counts_.dropped[static_cast<std::size_t>(reason)];
    ++totals_.left_out;
    if (!text.empty()) counts_.last_reason = text;
  }

  /// `waited`: s, from the stamp until the cloud was taken.
  void count(const dynains::FrameResult& frame, double seconds, double waited) {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_.taken;
    ++totals_.taken;
    counts_.busy += seconds;
    counts_.slowest = std::max(counts_.slowest, seconds);
    counts_.latency += waited + seconds;
    if (frame.began_epoch == dynains::EpochReason::kJump ||
        frame.began_epoch == dynains::EpochReason::kMisfit) {
      ++counts_.misfits;
    }
    if (frame.pose_residual) {
      ++counts_.residuals;
      counts_.residual += frame.pose_residual->translation;
    }
    if (remover_) state_.map_points = remover_->map().size();
    state_.suspicion = frame.plausibility.suspicion;
    state_.time_doubt = frame.time_doubt;
  }

  dynains::DynaInsRemover::Config remover_config_;
  Config config_;
  std::optional<dynains::DynaInsRemover> remover_;  // one of both
  std::optional<dynains::Odometry> odometry_;
  int lost_ = 0;                                            // clouds in a row
  dynains::Pose T_odom_start_ = dynains::Pose::Identity();  // of the odometry
  dynains::Pose T_odom_last_ = dynains::Pose::Identity();   // of the newest cloud
  std::size_t map_points_ = 0;                              // of the last map that was published
  double next_map_ = 0.0;                                   // s

  mutable std::mutex mutex_;  // guards all below
  CloudQueue<CloudPtr> queue_;
  bool must_reset_ = false;
  LoopCounts counts_;
  LoopTotals totals_;
  LoopState state_;
};

}  // namespace dynains_ros
