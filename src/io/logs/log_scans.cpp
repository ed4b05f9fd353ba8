#include "log_scans.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "../failure.hpp"
#include "../text.hpp"
#include "decompress.hpp"

namespace dynains {
namespace {

using Topics = std::vector<LogTopic>;

bool is_readable(const LogTopic& topic) {
  return topic.encoding != MessageEncoding::kOther && topic.message_count > 0;
}

/// "/points (sensor_msgs/PointCloud2, 120 messages), ..."
std::string list(const Topics& topics) {
  std::string text;
  for (const LogTopic& topic : topics) {
    text += (text.empty() ? "" : ", ") + topic.name + " (" + topic.type + ", " +
            std::to_string(topic.message_count) + " messages)";
  }
  return text.empty() ? "no topic" : text;
}

template <class Condition>
Topics filter(const Topics& topics, Condition&& is_wanted) {
  Topics result;
  std::copy_if(topics.begin(), topics.end(), std::back_inserter(result),
               [&](const LogTopic& topic) { return is_readable(topic) && is_wanted(topic.type); });
  return result;
}

bool has(const Topics& topics, const std::string& name) {
  return std::any_of(topics.begin(), topics.end(),
                     [&](const LogTopic& topic) { return topic.name == name; });
}

/// Index of the topic `chosen` by name and type.
std::uint32_t index_of(const Topics& topics, const LogTopic& chosen) {
  const auto found = std::find_if(topics.begin(), topics.end(), [&](const LogTopic& topic) {
    return topic.name == chosen.name && topic.type == chosen.type;
  });
  return static_cast<std::uint32_t>(found - topics.begin());
}

LogTopic named(const Topics& topics, const std::string& name) {
  return *std::find_if(topics.begin(), topics.end(),
                       [&](const LogTopic& topic) { return topic.name == name; });
}

}  // namespace

SerialisedMessage unpacked(const LogFile& log, const LogTopic& topic, std::uint64_t time,
                           std::vector<std::uint8_t>& bytes, std::vector<std::uint8_t>& spare) {
  std::string place =
      log.path().string() + ": " + topic.name + " at " + std::to_string(time) + " ns";
  if (topic.encoding == MessageEncoding::kCdr) {
    const std::string error = decompress_frame(bytes, spare);
    if (!error.empty()) throw IoError(place + ": " + error);
  }
  return {bytes.data(), bytes.size(), topic.encoding, std::move(place)};
}

LogScans::LogScans(const std::filesystem::path& path, const RecordingOptions& options,
                   bool with_poses)
    : log_(open_log(path, options.accept_missing)),
      options_(options),
      with_poses_(with_poses),
      transforms_(options.pose_gap) {
  choose_cloud_topic();
  if (with_poses) choose_pose_topic();
  read_log();
  check_clouds();
  if (with_poses) place_scans();
}

void LogScans::choose_cloud_topic() {
  const Topics clouds = filter(log_->topics(), is_cloud_type);
  if (clouds.empty()) {
    const std::string end = log_->early_end() ? "; " + *log_->early_end() : "";
    fail(log_->path(), "expected a topic with clouds; found " + list(log_->topics()) + end);
  }
  const std::string& wanted = options_.cloud_topic;
  if (wanted.empty() && clouds.size() > 1) {
    fail(log_->path(), "expected one topic with clouds, or --cloud-topic; found " + list(clouds));
  }
  if (!wanted.empty() && !has(clouds, wanted)) {
    fail(log_->path(), "expected clouds on topic " + wanted + "; found " + list(clouds));
  }
  const LogTopic chosen = wanted.empty() ? clouds.front() : named(clouds, wanted);
  cloud_topic_ = index_of(log_->topics(), chosen);
  notes_.push_back("clouds from topic " + chosen.name);
}

/// A topic of poses comes before transforms.
void LogScans::choose_pose_topic() {
  const Topics poses = filter(log_->topics(), is_pose_type);
  const Topics direct = filter(log_->topics(), [](const auto& type) {
    return is_pose_type(type) && !is_transform_type(type);
  });
  const std::string& wanted = options_.pose_topic;
  if (poses.empty()) {
    fail(log_->path(), "expected a topic with poses, or a file of poses by --poses; found " +
                           list(log_->topics()) +
                           "; without poses, dynains run --odometry estimates them");
  }
  if (!wanted.empty() && !has(poses, wanted)) {
    fail(log_->path(), "expected poses on topic " + wanted + "; found " + list(poses));
  }
  const bool by_frame = wanted.empty() && !options_.pose_frame.empty();
  if (wanted.empty() && !by_frame && direct.size() > 1) {
    fail(log_->path(), "expected one topic with poses, or --pose-topic; found " + list(poses));
  }
  LogTopic chosen;
  if (!wanted.empty()) chosen = named(poses, wanted);
  if (wanted.empty() && !by_frame && !direct.empty()) chosen = direct.front();
  if (chosen.name.empty() || is_transform_type(chosen.type)) {
    notes_.push_back("poses from transforms (tf)");
    return;
  }
  pose_topic_ = index_of(log_->topics(), chosen);
  notes_.push_back("poses from topic " + chosen.name);
}

void LogScans::read_log() {
  for (const LogMessage& message : log_->messages()) {
    const LogTopic& topic = log_->topics()[message.topic];
    if (message.topic == cloud_topic_) take_cloud(message);
    const bool is_transform = is_readable(topic) && is_transform_type(topic.type);
    const bool is_wanted = with_poses_ ? message.topic == pose_topic_ || is_transform
                                       : !options_.sensor_frame.empty() && is_transform;
    if (is_wanted) take_poses(message);
  }
  transforms_.sort();
  sort_by_time(poses_);
}

void LogScans::take_cloud(const LogMessage& message) {
  const SerialisedMessage serialised = load(message);
  const CloudInfo cloud = inspect_cloud(log_->topics()[message.topic].type, serialised);
  ++clouds_of_frames_[cloud.frame];
  if (clouds_.empty()) {
    cloud_frame_ = options_.cloud_frame.empty() ? cloud.frame : options_.cloud_frame;
    columns_ = cloud.columns;
  }
  if (cloud.frame != cloud_frame_) return;
  if (!times_.empty() && !(cloud.time > times_.back())) {
    ++disordered_;
    return;
  }
  clouds_.push_back(message);
  times_.push_back(cloud.time);
  point_counts_.push_back(cloud.points);
}

void LogScans::take_poses(const LogMessage& message) {
  const LogTopic& topic = log_->topics()[message.topic];
  const bool is_static = topic.name.find("static") != std::string::npos;
  for (const StampedPose& pose : read_poses(topic.type, load(message))) {
    if (message.topic != pose_topic_) {
      transforms_.add(pose, is_static);
      continue;
    }
    if (poses_.poses.empty()) {
      pose_frame_ = pose.frame;
      pose_child_ = pose.child;
    }
    append(pose.time, pose.T_frame_child, poses_);
  }
}

void LogScans::check_clouds() {
  if (clouds_.empty() || (clouds_of_frames_.size() > 1 && options_.cloud_frame.empty())) {
    std::vector<std::string> found;
    for (const auto& [frame, count] : clouds_of_frames_) {
      found.push_back(frame + " (" + std::to_string(count) + ")");
    }
    fail(log_->path(),
         "expected clouds of one frame, or --frame-id for those of one sensor; found "
         "frames " +
             text::listed(found));
  }
  if (disordered_ == 0) return;
  const std::string count = std::to_string(disordered_) + " of " +
                            std::to_string(disordered_ + size()) +
                            " clouds have a stamp that is not after that of the cloud before";
  if (disordered_ >= size()) fail(log_->path(), "expected stamps that increase: " + count);
  const bool are_many = 10 * disordered_ > size();
  (are_many ? warnings_ : notes_).push_back(count + ", and are left out");
}

void LogScans::place_scans() {
  posed_frame_ = cloud_frame_;
  if (!pose_topic_) choose_frames();
  is_in_world_ = pose_topic_ && cloud_frame_ == pose_frame_ && cloud_frame_ != pose_child_;
  if (pose_topic_ && !is_in_world_) describe_extrinsic();
  if (transforms_.left_out() > 0) {
    notes_.push_back(std::to_string(transforms_.left_out()) +
                     " transforms contradict earlier ones of their frame, and are left out");
  }
  for (const double stamp : times_) {
    const double time = stamp + options_.time_offset;
    const std::optional<Pose> T_world_sensor = pose_at(time);
    if (!T_world_sensor) continue;
    trajectory_.times.push_back(time);
    trajectory_.poses.push_back(*T_world_sensor);
  }
  if (2 * trajectory_.poses.size() < times_.size()) fail_without_poses();
}

/// Names both ranges of time, for the usual reason is two clocks.
void LogScans::fail_without_poses() const {
  const std::vector<double> poses = pose_topic_ ? poses_.times : transforms_.times();
  const std::size_t found = trajectory_.poses.size();
  std::string text = "expected poses of frame " +
                     (pose_child_.empty() ? posed_frame_ : pose_child_) + " in " + pose_frame_ +
                     " at the times of the clouds, found " +
                     (found == 0 ? "none" : std::to_string(found)) + " for " +
                     std::to_string(size()) + " clouds, which are from " +
                     text::in_seconds(times_.front()) + " to " + text::in_seconds(times_.back());
  if (options_.time_offset != 0.0) {
    text += " (by --time-offset " + text::in_seconds(options_.time_offset) + " later)";
  }
  if (!poses.empty()) {
    text += "; poses are from " + text::in_seconds(poses.front()) + " to " +
            text::in_seconds(poses.back());
  }
  fail(log_->path(), text +
                         ". If the clocks differ, --time-offset S takes the pose at t + S for a "
                         "cloud at t");
}

std::optional<Pose> LogScans::T_cloud_frame(const std::string& frame) const {
  return transforms_.find(cloud_frame_, frame, times_.front());
}

std::string LogScans::known_frames() const { return text::listed(transforms_.frames()); }

Trajectory LogScans::motion() const {
  Trajectory motion;
  for (const double time : pose_topic_ ? poses_.times : transforms_.times()) {
    const std::optional<Pose> T_world_sensor = pose_at(time);
    if (!T_world_sensor) continue;
    motion.times.push_back(time);
    motion.poses.push_back(*T_world_sensor);
  }
  return motion;
}

/// The fixed frame of poses from transforms is that of the options, or the root of the tree.
void LogScans::choose_frames() {
  const bool is_led = !options_.pose_frame.empty() || transforms_.is_moving(cloud_frame_) ||
                      transforms_.moving_frames().empty();
  if (!transforms_.has(cloud_frame_) || !is_led) {
    posed_frame_ = body_frame();
    notes_.push_back("poses of " + posed_frame_ +
                     ", in which --extrinsic places the sensor: the log has no transform between "
                     "the two");
  }
  const std::optional<std::string> root = transforms_.root_of(posed_frame_);
  if (!root) {
    fail(log_->path(), "expected transforms that form a tree of at most " +
                           std::to_string(TransformTree::kDeepest) +
                           " levels, found a loop or more above frame " + posed_frame_);
  }
  pose_frame_ = options_.pose_frame.empty() ? *root : options_.pose_frame;
}

/// The frame of the robot whose pose in the world transforms give.
std::string LogScans::body_frame() const {
  const std::vector<std::string> moving = transforms_.moving_frames();
  if (options_.convention.T_body_sensor.isApprox(Pose::Identity(), 0.0)) {
    const bool is_known = transforms_.has(cloud_frame_);
    const std::string body = moving.empty() ? std::string("that frame") : moving.front();
    fail(
        log_->path(),
        std::string("expected a ") + (is_known ? "moving transform above" : "transform of") +
            " frame " + cloud_frame_ + ", that of the clouds; found " +
            (is_known ? "moving transforms of " + text::listed(moving)
                      : "transforms of " + text::listed(transforms_.frames())) +
            ". If the log lacks the calibration, --extrinsic gives the pose of " + cloud_frame_ +
            " in " + body +
            (is_known ? "; if the sensor stands still, --pose-frame-id names the frame it stands in"
                      : ""));
  }
  const std::optional<std::string> body = transforms_.moving_body();
  if (body) return *body;
  fail(log_->path(), "expected one moving body for --extrinsic, found moving transforms of " +
                         text::listed(moving));
}

/// Poses of a topic are those of a frame of the robot, mostly not of the sensor.
void LogScans::describe_extrinsic() {
  if (pose_child_.empty() || pose_child_ == cloud_frame_) {
    pose_child_.clear();
    return;
  }
  if (transforms_.find(pose_child_, cloud_frame_, times_.front())) {
    notes_.push_back("the transform from " + cloud_frame_ + " to " + pose_child_ +
                     " is from the log");
    return;
  }
  notes_.push_back("the log has no transform from " + cloud_frame_ + " to " + pose_child_ +
                   ": poses count as those of " + cloud_frame_);
  pose_child_.clear();
}

/// T_world_sensor at `time`, s.
std::optional<Pose> LogScans::pose_at(double time) const {
  if (!pose_topic_) return transforms_.find(pose_frame_, posed_frame_, time);
  const std::optional<TrajectoryMatch> match = match_time(poses_, time, options_.pose_gap);
  if (!match) return std::nullopt;
  const Pose T_world_child =
      interpolate(poses_.poses[match->before], poses_.poses[match->after], match->share);
  if (pose_child_.empty() || is_in_world_) return T_world_child;
  const auto T_child_sensor = transforms_.find(pose_child_, cloud_frame_, time);
  if (!T_child_sensor) return std::nullopt;
  return T_world_child * *T_child_sensor;
}

/// The message, in memory until the next one.
SerialisedMessage LogScans::load(const LogMessage& message) {
  log_->read(message, bytes_);
  return unpacked(*log_, log_->topics()[message.topic], message.time, bytes_, compressed_);
}

void LogScans::read(std::size_t i, RecordedScan& scan) {
  const LogMessage& message = clouds_.at(i);
  read_cloud(log_->topics()[message.topic].type, load(message), scan);
}

std::vector<std::uint32_t> LogScans::read_labels(std::size_t i) {
  const LogMessage& message = clouds_.at(i);
  return read_cloud_labels(log_->topics()[message.topic].type, load(message));
}

}  // namespace dynains
