// The work of a node: clouds are joined to frames, which wait for their poses, are cleaned in
// order, and are counted. Without types of ROS.
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
#include "ros_common/frame_joiner.hpp"
#include "ros_common/loop_report.hpp"
#include "ros_common/sensor_rig.hpp"

namespace dynains_ros {

/// The result for one frame.
struct Cleaned {
  /// Labels of the points of all clouds, one cloud after the other; empty if not judged.
  dynains::Span<const dynains::PointLabel> labels;
  std::optional<dynains::Pose> T_odom_sensor;  ///< by the own odometry, if it has track
  const dynains::FrameResult& frame;
  const std::string& frame_id;  ///< of the clouds of the first topic, in which all poses are

  /// Calls `visit(topic, cloud, labels)` for each cloud, with the labels of its points.
  template <class CloudPtr, class Visit>
  void for_each_cloud(const Frame<CloudPtr>& clouds, Visit&& visit) const {
    std::size_t begin = 0;
    for (std::size_t i = 0; i < clouds.clouds.size(); ++i) {
      if (!clouds.clouds[i]) continue;
      const auto& cloud = *clouds.clouds[i];
      const std::size_t count =
          labels.empty() ? 0 : std::size_t{cloud.width} * std::size_t{cloud.height};
      visit(i, cloud, dynains::Span<const dynains::PointLabel>(labels.data() + begin, count));
      begin += count;
    }
  }
};

/// `CloudPtr` points to a PointCloud2 message; clouds of several topics are joined to frames. add()
/// and report() may be called by any thread, the other functions by one thread. Times are in
/// seconds.
template <class CloudPtr>
class RemoverLoop {
 public:
  struct Config {
    double patience = 0.2;      ///< s, how long a frame waits for its pose
    std::size_t capacity = 10;  ///< frames that wait
    double map_period = 2.0;    ///< s, between two maps
    bool odometry = false;      ///< poses are those of dynains::Odometry, and there is no map
    std::size_t topics = 1;     ///< of clouds, from 1 to 255
    std::vector<std::string> sensor_frames = {};  ///< see SensorRig
  };

  /// Throws dynains::ConfigError.
  RemoverLoop(const dynains::DynaInsRemover::Config& remover, const Config& config)
      : remover_config_(remover),
        config_(config),
        rig_(config.topics, config.sensor_frames),
        joiner_(config.topics),
        queue_(config.patience, config.capacity) {
    if (config.topics < 1 || config.topics > 255) {
      throw dynains::ConfigError("topics = " + std::to_string(config.topics) +
                                 " names; expected 1 to 255");
    }
    if (!config.sensor_frames.empty() && config.sensor_frames.size() != config.topics) {
      throw dynains::ConfigError(std::to_string(config.sensor_frames.size()) +
                                 " frames of sensors for " + std::to_string(config.topics) +
                                 " topics of clouds; expected one each, or none");
    }
    if (rig_.has_sensors()) remover_config_.sensors = rig_.sensors();
    start();
  }

  /// Lets a cloud wait for those of the other topics, and for its pose. Returns whether the time
  /// jumped backwards: the caller forgets its transforms, and the remover starts anew with this
  /// cloud.
  bool add(CloudPtr cloud, double now, std::size_t topic = 0) {
    const double stamp = dynains::message_time(*cloud);
    const std::lock_guard<std::mutex> lock(mutex_);
    bool has_jumped = false;
    joiner_.add(topic, std::move(cloud), stamp, now, [&](Frame<CloudPtr> frame) {
      has_jumped = enqueue(std::move(frame), now) || has_jumped;
    });
    return has_jumped;
  }

  bool is_waiting() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return !queue_.empty() || joiner_.is_waiting();
  }

  /// How long to wait for new clouds or poses before the next call of clean_next(), which has just
  /// returned `has_cleaned`.
  std::chrono::milliseconds pause_after(bool has_cleaned) const {
    constexpr std::chrono::milliseconds kForPose{5}, kForCloud{50};
    if (has_cleaned) return std::chrono::milliseconds::zero();
    return is_waiting() ? kForPose : kForCloud;
  }

  /// Cleans the oldest frame if its pose is known, and calls `publish(frame, cleaned)`.
  /// `find_pose`, which is not called with Config::odometry, and `find_extrinsic`: see
  /// SensorRig::place(). Returns whether a frame was taken. `now`: by the clock of the stamps.
  template <class FindPose, class FindExtrinsic, class Publish>
  bool clean_next(double now, FindPose&& find_pose, FindExtrinsic&& find_extrinsic,
                  Publish&& publish) {
    const auto next = take(now, find_pose, find_extrinsic);
    if (!next) return false;
    const Frame<CloudPtr>& clouds = next->cloud;
    const auto begin = std::chrono::steady_clock::now();
    const auto seconds = [begin] {
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    };
    dynains::FrameResult frame;
    std::optional<dynains::Pose> T_odom_sensor;
    try {
      take_new_sensors();
      if (config_.topics > 1) {
        T_odom_sensor = push(clouds, rig_.merge(clouds), next->T_fixed_sensor, frame);
      } else {
        const dynains::PointCloud2View points(*clouds.anchor());
        T_odom_sensor = push(clouds, points, next->T_fixed_sensor, frame);
      }
    } catch (const std::exception& error) {
      const std::lock_guard<std::mutex> lock(mutex_);
      count(Drop::kInvalid, error.what());
      return true;
    }
    attempt([&] {
      publish(clouds, Cleaned{frame.newest().labels, T_odom_sensor, frame, rig_.frame_id()});
    });
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
  bool enqueue(Frame<CloudPtr> frame, double now) {
    ++counts_.arrived;
    const double stamp = frame.stamp;
    const bool has_jumped =
        queue_.add(std::move(frame), stamp, now, [this](Drop reason) { count(reason); });
    if (has_jumped) {
      joiner_.clear();
      must_reset_ = true;
      ++totals_.resets;
    }
    return has_jumped;
  }

  template <class FindPose, class FindExtrinsic>
  auto take(double now, FindPose&& find_pose, FindExtrinsic&& find_extrinsic) {
    const std::lock_guard<std::mutex> lock(mutex_);
    joiner_.poll(now, [&](Frame<CloudPtr> frame) { enqueue(std::move(frame), now); });
    if (std::exchange(must_reset_, false)) start();
    return queue_.take(
        now,
        [&](const Frame<CloudPtr>& frame) {
          return rig_.place(frame, !config_.odometry, find_pose, find_extrinsic);
        },
        [this](Drop reason, const std::string& text) { count(reason, text); });
  }

  /// A remover has all sensors from its start, so it begins anew when a sensor is found.
  void take_new_sensors() {
    if (!rig_.take_new_sensor() || !rig_.has_sensors()) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    remover_config_.sensors = rig_.sensors();
    start();
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

  /// Pushes the points of a frame. With odometry: their pose, none after a loss. An odometry that
  /// stays lost, or that clouds are missing for, begins anew where it was.
  template <class Points>
  std::optional<dynains::Pose> push(const Frame<CloudPtr>& clouds, const Points& points,
                                    const dynains::Pose& T_fixed_sensor,
                                    dynains::FrameResult& frame) {
    if (remover_) {
      frame = remover_->push(points, T_fixed_sensor, clouds.stamp);
      return std::nullopt;
    }
    constexpr int kMaxLost = 5;  // frames
    const std::vector<double> offsets = SensorRig<CloudPtr>::offsets(clouds);
    dynains::OdometryResult result = odometry_->push(points, offsets, clouds.stamp);
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
  SensorRig<CloudPtr> rig_;
  std::optional<dynains::DynaInsRemover> remover_;  // one of both
  std::optional<dynains::Odometry> odometry_;
  int lost_ = 0;                                            // frames in a row
  dynains::Pose T_odom_start_ = dynains::Pose::Identity();  // of the odometry
  dynains::Pose T_odom_last_ = dynains::Pose::Identity();   // of the newest frame
  std::size_t map_points_ = 0;                              // of the last map that was published
  double next_map_ = 0.0;                                   // s

  mutable std::mutex mutex_;  // guards all below
  FrameJoiner<CloudPtr> joiner_;
  CloudQueue<Frame<CloudPtr>> queue_;
  bool must_reset_ = false;
  LoopCounts counts_;
  LoopTotals totals_;
  LoopState state_;
};

}  // namespace dynains_ros
