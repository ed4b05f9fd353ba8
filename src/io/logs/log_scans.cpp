#include "log_scans.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <set>
#include <utility>

#include "../failure.hpp"
#include "../text.hpp"
#include "decompress.hpp"
#include "dynains/errors.hpp"
#include "dynains/io/trajectory.hpp"
#include "dynains/median.hpp"
#include "transform_tree.hpp"

namespace dynains {
namespace {

using Topics = std::vector<std::uint32_t>;  // of a log, by index

bool is_readable(const LogTopic& topic) {
  return topic.encoding != MessageEncoding::kOther && topic.message_count > 0;
}

/// The readable topics of some types.
template <class Condition>
Topics filter(const LogFile& log, Condition&& is_wanted) {
  Topics result;
  for (std::uint32_t i = 0; i < log.topics().size(); ++i) {
    if (is_readable(log.topics()[i]) && is_wanted(log.topics()[i].type)) result.push_back(i);
  }
  return result;
}

/// "/points (sensor_msgs/PointCloud2, 120 messages), ..."
std::string text_of(const LogTopic& topic) {
  return topic.name + " (" + topic.type + ", " + std::to_string(topic.message_count) + " messages)";
}
std::string list(const LogFile& log, const Topics& topics) {
  std::string text;
  for (const std::uint32_t i : topics) {
    text += (text.empty() ? "" : ", ") + text_of(log.topics()[i]);
  }
  return text.empty() ? "no topic" : text;
}
std::string list(const LogFile& log) {
  Topics all(log.topics().size());
  std::iota(all.begin(), all.end(), 0U);
  return list(log, all);
}

/// Whether messages hold what a sensor sent, as a driver records it.
bool has_packets(const std::string& type) {
  constexpr const char* kNames[] = {"Packet", "VelodyneScan", "PandarScan", "rslidarScan",
                                    "UdpFrame"};
  return std::any_of(std::begin(kNames), std::end(kNames), [&](const char* name) {
    return type.find(name, type.rfind('/') + 1) != std::string::npos;
  });
}

std::optional<std::uint32_t> find(const LogFile& log, const Topics& topics,
                                  const std::string& name) {
  const auto found = std::find_if(topics.begin(), topics.end(),
                                  [&](std::uint32_t i) { return log.topics()[i].name == name; });
  return found == topics.end() ? std::nullopt : std::optional(*found);
}

/// "/robot1" of "/robot1/tf", "" of "/tf".
std::string namespace_of(const std::string& topic) {
  const std::size_t end = topic.rfind('/');
  return end == std::string::npos ? std::string() : topic.substr(0, end);
}

/// The transforms of a topic. Those nearest to clouds are of the namespace of `pose_topic`, if it
/// is given, else of the innermost one that the topic of the clouds lies in.
TransformSource source_of(const std::string& topic, const std::string& cloud_topic,
                          const std::string& pose_topic) {
  const std::string name = namespace_of(topic);
  const bool holds_clouds = name.empty() || cloud_topic.rfind(name + '/', 0) == 0;
  const bool is_chosen = !pose_topic.empty() && name == namespace_of(pose_topic);
  return {name, is_chosen ? std::string::npos : holds_clouds ? name.size() + 1 : 0};
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

class LogOpener {
 public:
  explicit LogOpener(RecordingContents& r)
      : r_(r),
        with_poses_(r.options.poses.empty() && !r.options.without_poses),
        scans_(std::make_unique<LogScans>(open_log(r.folder, r.options.accept_missing))),
        log_(*scans_->log_),
        sources_(scans_->sources_),
        transforms_(r.options.pose_gap) {}

  std::unique_ptr<LogScans> open() {
    choose_cloud_topics();
    if (with_poses_) choose_pose_topic();
    read_log();
    for (const Source& source : sources_) check_clouds(source);
    form_scans();
    describe_log();
    find_sensors();
    if (scans_->is_merged()) find_clocks();
    if (with_poses_) place_scans();
    if (r_.options.sensors.empty() && !r_.options.sensor_frame.empty()) {
      r_.options.sensor_origin = T_cloud_frame(r_.options.sensor_frame).translation();
    }
    const bool is_in_world = r_.frame == PointFrame::kWorld;
    if (scans_->is_merged() && !is_in_world) r_.clock = std::make_shared<const PointClock>();
    if (with_poses_ && (r_.options.deskew || r_.clock)) {
      r_.motion = motion(pose_topic_ ? poses_.times : transforms_.times());
    }
    pose_by_stamps(r_, r_.folder);
    return std::move(scans_);
  }

 private:
  using Source = LogScans::Source;

  [[noreturn]] void fail(const std::string& what) const { dynains::fail(log_.path(), what); }

  void choose_cloud_topics() {
    const Topics clouds = filter(log_, is_cloud_type);
    if (clouds.empty()) {
      std::string end = log_.early_end() ? "; " + *log_.early_end() : "";
      if (!filter(log_, has_packets).empty()) {
        end +=
            "; packets of a sensor are not read: play the log through the ROS driver of the "
            "sensor, and record sensor_msgs/PointCloud2";
      }
      fail("expected a topic with clouds; found " + list(log_) + end);
    }
    std::vector<std::string> wanted = text::names_in(r_.options.cloud_topic);
    if (wanted.empty() && clouds.size() > 1) {
      fail("expected one topic with clouds, or --cloud-topic; found " + list(log_, clouds));
    }
    if (wanted.empty()) wanted.push_back(log_.topics()[clouds.front()].name);
    for (const std::string& name : wanted) {
      const auto topic = find(log_, clouds, name);
      if (!topic) fail("expected clouds on topic " + name + "; found " + list(log_, clouds));
      if (scans_->has_topic(*topic)) fail("expected each topic once, found " + name + " twice");
      sources_.emplace_back().topic = *topic;
      r_.notes.push_back("clouds from topic " + name);
    }
  }

  /// A topic of poses comes before transforms.
  void choose_pose_topic() {
    const Topics poses = filter(log_, is_pose_type);
    const Topics direct = filter(
        log_, [](const auto& type) { return is_pose_type(type) && !is_transform_type(type); });
    const std::string& wanted = r_.options.pose_topic;
    if (poses.empty()) {
      fail("expected a topic with poses, or a file of poses by --poses; found " + list(log_) +
           "; without poses, dynains run --odometry estimates them");
    }
    std::optional<std::uint32_t> chosen = find(log_, poses, wanted);
    if (!wanted.empty() && !chosen) {
      fail("expected poses on topic " + wanted + "; found " + list(log_, poses));
    }
    if (wanted.empty() && r_.options.pose_frame.empty()) {
      if (direct.size() > 1) {
        fail("expected one topic with poses, or --pose-topic; found " + list(log_, poses));
      }
      if (!direct.empty()) chosen = direct.front();
    }
    if (!chosen || is_transform_type(log_.topics()[*chosen].type)) {
      r_.notes.push_back("poses from transforms (tf)");
      return;
    }
    pose_topic_ = *chosen;
    r_.notes.push_back("poses from topic " + log_.topics()[*chosen].name);
  }

  void read_log() {
    const bool with_transforms =
        with_poses_ || scans_->is_merged() || !r_.options.sensor_frame.empty() ||
        std::any_of(log_.topics().begin(), log_.topics().end(),
                    [](const LogTopic& topic) { return is_concatenation_type(topic.type); });
    for (const LogMessage& message : log_.messages()) {
      const LogTopic& topic = log_.topics()[message.topic];
      for (Source& source : sources_) {
        if (message.topic == source.topic) take_cloud(message, source);
      }
      if (!is_readable(topic)) continue;
      const bool is_transform = with_transforms && is_transform_type(topic.type);
      if (is_transform || message.topic == pose_topic_) take_poses(message);
      if (is_concatenation_type(topic.type)) {
        Concatenation concatenation = read_concatenation(scans_->load(message));
        scans_->concatenations_[concatenation.time] = std::move(concatenation.parts);
      }
    }
    transforms_.sort();
    sort_by_time(poses_);
  }

  void take_cloud(const LogMessage& message, Source& source) {
    const CloudInfo cloud = inspect_cloud(log_.topics()[message.topic].type, scans_->load(message));
    ++source.frames[cloud.frame];
    if (source.clouds.empty()) {
      source.frame = r_.options.cloud_frame.empty() ? cloud.frame : r_.options.cloud_frame;
      source.columns = cloud.columns;
    }
    if (cloud.frame != source.frame) return;
    if (!source.clouds.empty() && !(cloud.time > source.clouds.back().time)) {
      ++disordered_;
      return;
    }
    source.clouds.push_back({message, cloud.time, cloud.points});
  }

  void take_poses(const LogMessage& message) {
    const LogTopic& topic = log_.topics()[message.topic];
    const bool is_static = topic.name.find("static") != std::string::npos;
    const std::string& clouds = log_.topics()[sources_.front().topic].name;
    const TransformSource source = source_of(topic.name, clouds, r_.options.pose_topic);
    for (const StampedPose& pose : dynains::read_poses(topic.type, scans_->load(message))) {
      if (message.topic != pose_topic_) {
        transforms_.add(pose, is_static, source);
        continue;
      }
      if (poses_.poses.empty()) {
        pose_frame_ = pose.frame;
        pose_child_ = pose.child;
      }
      append(pose.time, pose.T_frame_child, poses_);
    }
  }

  void check_clouds(const Source& source) const {
    if (!source.clouds.empty() && (source.frames.size() == 1 || !r_.options.cloud_frame.empty())) {
      return;
    }
    std::vector<std::string> found;
    for (const auto& [frame, count] : source.frames) {
      found.push_back(frame + " (" + std::to_string(count) + ")");
    }
    fail("expected clouds of one frame, or --frame-id for those of one sensor; found frames " +
         text::listed(found));
  }

  /// A cloud belongs to the nearest scan, if that is near; a sensor may be missing or come twice.
  void form_scans() {
    std::vector<double> steps;
    const std::vector<LogCloud>& first = sources_.front().clouds;
    for (std::size_t i = 1; i < first.size(); ++i) {
      steps.push_back(first[i].time - first[i - 1].time);
    }
    const double near = 0.5 * median(std::move(steps));
    std::map<double, std::vector<LogCloud>> scans;
    for (const Source& source : sources_) {
      const bool is_first = &source == &sources_.front();
      for (const LogCloud& cloud : source.clouds) {
        auto scan = scans.lower_bound(cloud.time);
        const bool has_before = scan != scans.begin();
        if (has_before && (scan == scans.end() ||
                           cloud.time - std::prev(scan)->first < scan->first - cloud.time)) {
          --scan;
        }
        const bool is_near = scan != scans.end() && std::abs(scan->first - cloud.time) <= near;
        (is_near && !is_first ? scan->second : scans[cloud.time]).push_back(cloud);
      }
    }
    for (auto& [time, clouds] : scans) {
      const std::size_t number = r_.scans.size();
      const std::string digits = std::to_string(number);
      const std::string zeros(digits.size() < 6 ? 6 - digits.size() : 0, '0');
      r_.scans.push_back({r_.folder, zeros + digits, number, time});
      scans_->scans_.push_back(std::move(clouds));
    }
    cloud_frame_ = sources_.front().frame;
    PointColumns& columns = scans_->columns_ = sources_.front().columns;
    for (const Source& source : sources_) {
      columns.intensity |= source.columns.intensity;
      columns.ring |= source.columns.ring;
      columns.time |= source.columns.time;
      columns.label &= source.columns.label;
    }
  }

  /// Takes what the log states of itself, and notes clouds that are left out.
  void describe_log() {
    r_.scan_folder = r_.folder;
    r_.format = ScanFormat::kLog;
    r_.is_numbered = true;
    r_.files = log_.files();
    r_.early_end = log_.early_end();
    if (r_.early_end) {
      r_.warnings.push_back(*r_.early_end + "; " + std::to_string(r_.scans.size()) +
                            " scans before it are read");
    }
    if (log_.missing_parts()) r_.warnings.push_back(*log_.missing_parts());
    if (disordered_ == 0) return;
    std::size_t taken = 0;
    for (const Source& source : sources_) taken += source.clouds.size();
    const std::string count = std::to_string(disordered_) + " of " +
                              std::to_string(disordered_ + taken) +
                              " clouds have a stamp that is not after that of the cloud before";
    if (disordered_ >= taken) fail("expected stamps that increase: " + count);
    const bool are_many = 10 * disordered_ > taken;
    (are_many ? r_.warnings : r_.notes).push_back(count + ", and are left out");
  }

  /// Several sensors are those of the options, of the topics, or of clouds that were put together
  /// before they were recorded.
  void find_sensors() {
    const bool is_merged = scans_->is_merged();
    std::vector<std::string> frames = text::names_in(r_.options.sensor_frame);
    if (frames.size() == 1) frames.clear();  // the origin of all
    std::vector<Pose> sensors = r_.options.sensors;
    const bool are_given = !frames.empty() || !sensors.empty();
    if (!are_given && is_merged) {
      for (const Source& source : sources_) frames.push_back(source.frame);
    }
    for (const std::string& frame : frames) sensors.push_back(T_cloud_frame(frame));
    if (!are_given && !is_merged) sensors = concatenated_sensors();
    if (is_merged && sensors.size() != sources_.size()) {
      throw ConfigError("expected one sensor for each of " + std::to_string(sources_.size()) +
                        " topics, found " + std::to_string(sensors.size()));
    }
    bool are_moved = are_given || !is_merged;  // before they were recorded
    for (std::size_t k = 0; is_merged && k < sources_.size(); ++k) {
      if (sources_[k].frame == cloud_frame_) continue;
      are_moved = true;
      sources_[k].T_scan_cloud =
          r_.options.sensors.empty() ? T_cloud_frame(sources_[k].frame) : sensors[k];
    }
    if (are_moved) {
      if (r_.options.sensors.empty()) r_.options.sensors = std::move(sensors);
      return;
    }
    r_.warnings.push_back("the clouds of all topics are in frame " + cloud_frame_ +
                          ", so their beams count as those of one sensor there; --sensor-frame "
                          "A,B names the frames of the sensors");
  }

  /// The sensors of concatenated clouds, from a topic of ConcatenatedPointCloudInfo.
  std::vector<Pose> concatenated_sensors() {
    std::set<std::string> frames;
    for (const auto& [time, parts] : scans_->concatenations_) {
      for (const Concatenation::Part& part : parts) {
        if (part.length > 0) frames.insert(part.frame);
      }
    }
    std::vector<Pose> sensors;
    try {
      for (const std::string& frame : frames) sensors.push_back(T_cloud_frame(frame));
    } catch (const IoError& error) {
      r_.warnings.push_back("points of several sensors count as those of one: " +
                            std::string(error.what()));
      return {};
    }
    scans_->concatenated_.assign(frames.begin(), frames.end());
    return sensors;
  }

  /// The clocks of points, if the times of points count.
  void find_clocks() {
    if (!r_.options.deskew && (with_poses_ || r_.options.is_compensated)) return;
    RecordedScan scan;
    for (Source& source : sources_) {
      if (!source.columns.time) continue;
      std::vector<double> times;
      for (const LogCloud& cloud : source.clouds) times.push_back(cloud.time);
      source.clock = found_clock(r_, log_.topics()[source.topic].name, times,
                                 [&](std::size_t i) -> const RecordedScan& {
                                   scans_->read(source.clouds[i], scan);
                                   return scan;
                                 });
    }
  }

  void place_scans() {
    posed_frame_ = cloud_frame_;
    if (!pose_topic_) choose_frames();
    pose_topic_ ? refuse_conflict(pose_child_, cloud_frame_)
                : refuse_conflict(pose_frame_, posed_frame_);
    const bool is_in_world =
        pose_topic_ && cloud_frame_ == pose_frame_ && cloud_frame_ != pose_child_;
    if (is_in_world) r_.frame = PointFrame::kWorld;
    if (pose_topic_ && !is_in_world) describe_extrinsic();
    if (transforms_.left_out() > 0) {
      r_.notes.push_back(std::to_string(transforms_.left_out()) +
                         " transforms contradict earlier ones of their frame, and are left out");
    }
    std::vector<double> times;
    for (const ScanEntry& scan : r_.scans) times.push_back(scan.time + r_.options.time_offset);
    r_.trajectory = motion(times);
    if (2 * r_.trajectory.poses.size() < times.size()) fail_without_poses();
  }

  /// Names both ranges of time, for the usual reason is two clocks.
  [[noreturn]] void fail_without_poses() const {
    const std::vector<double> poses = pose_topic_ ? poses_.times : transforms_.times();
    const std::size_t found = r_.trajectory.poses.size();
    std::string text =
        "expected poses of frame " + (pose_child_.empty() ? posed_frame_ : pose_child_) + " in " +
        pose_frame_ + " at the times of the clouds, found " +
        (found == 0 ? "none" : std::to_string(found)) + " for " + std::to_string(r_.scans.size()) +
        " clouds, which are from " + text::in_seconds(r_.scans.front().time) + " to " +
        text::in_seconds(r_.scans.back().time);
    if (r_.options.time_offset != 0.0) {
      text += " (by --time-offset " + text::in_seconds(r_.options.time_offset) + " later)";
    }
    if (!poses.empty()) {
      text += "; poses are from " + text::in_seconds(poses.front()) + " to " +
              text::in_seconds(poses.back());
    }
    fail(text + ". If the clocks differ, --time-offset S takes the pose at t + S for a cloud at t");
  }

  void refuse_conflict(const std::string& target, const std::string& source) const {
    const std::optional<std::string> conflict = transforms_.conflict(target, source);
    if (!conflict) return;
    fail("expected transforms of one robot, found different ones of " + *conflict +
         "; --pose-topic names a topic in the right one");
  }

  /// Pose of `frame` in the frame of the clouds at the time of the first one.
  Pose T_cloud_frame(const std::string& frame) const {
    refuse_conflict(cloud_frame_, frame);
    const auto T_cloud_frame = transforms_.find(cloud_frame_, frame, r_.scans.front().time);
    if (T_cloud_frame) return *T_cloud_frame;
    fail("expected a transform from frame " + cloud_frame_ + " of the clouds to frame " + frame +
         "; found transforms of " + text::listed(transforms_.frames()));
  }

  /// The fixed frame of poses from transforms is that of the options, or the root of the tree.
  void choose_frames() {
    const std::string& wanted = r_.options.pose_frame;
    const bool is_led = !wanted.empty() || transforms_.is_moving(cloud_frame_) ||
                        transforms_.moving_frames().empty();
    if (!transforms_.has(cloud_frame_) || !is_led) {
      posed_frame_ = body_frame();
      r_.notes.push_back("poses of " + posed_frame_ +
                         ", in which --extrinsic places the sensor: the log has no transform "
                         "between the two");
    }
    const std::optional<std::string> root = transforms_.root_of(posed_frame_);
    if (!root) {
      fail("expected transforms that form a tree of at most " +
           std::to_string(TransformTree::kDeepest) + " levels, found a loop or more above frame " +
           posed_frame_);
    }
    pose_frame_ = wanted.empty() ? *root : wanted;
  }

  /// The frame of the robot whose pose in the world transforms give.
  std::string body_frame() const {
    const std::vector<std::string> moving = transforms_.moving_frames();
    if (r_.options.convention.T_body_sensor.isApprox(Pose::Identity(), 0.0)) {
      const bool is_known = transforms_.has(cloud_frame_);
      const std::string body = moving.empty() ? std::string("that frame") : moving.front();
      fail(std::string("expected a ") + (is_known ? "moving transform above" : "transform of") +
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
    fail("expected one moving body for --extrinsic, found moving transforms of " +
         text::listed(moving));
  }

  /// Poses of a topic are those of a frame of the robot, mostly not of the sensor.
  void describe_extrinsic() {
    if (!pose_child_.empty() && pose_child_ != cloud_frame_) {
      if (transforms_.find(pose_child_, cloud_frame_, r_.scans.front().time)) {
        r_.notes.push_back("the transform from " + cloud_frame_ + " to " + pose_child_ +
                           " is from the log");
        return;
      }
      r_.notes.push_back("the log has no transform from " + cloud_frame_ + " to " + pose_child_ +
                         ": poses count as those of " + cloud_frame_);
    }
    pose_child_.clear();
  }

  /// T_world_sensor (T_world_body if the extrinsic calibration is the user's) at those of `times`,
  /// s, at which it is known.
  Trajectory motion(const std::vector<double>& times) const {
    Trajectory motion;
    for (const double time : times) {
      const std::optional<Pose> T_world_sensor = pose_at(time);
      if (T_world_sensor) append(time, *T_world_sensor, motion);
    }
    return motion;
  }

  std::optional<Pose> pose_at(double time) const {
    if (!pose_topic_) return transforms_.find(pose_frame_, posed_frame_, time);
    const std::optional<TrajectoryMatch> match = match_time(poses_, time, r_.options.pose_gap);
    if (!match) return std::nullopt;
    const Pose T_world_child =
        interpolate(poses_.poses[match->before], poses_.poses[match->after], match->share);
    if (pose_child_.empty() || r_.frame == PointFrame::kWorld) return T_world_child;
    const auto T_child_sensor = transforms_.find(pose_child_, cloud_frame_, time);
    if (!T_child_sensor) return std::nullopt;
    return T_world_child * *T_child_sensor;
  }

  RecordingContents& r_;
  bool with_poses_;  // of the log
  std::unique_ptr<LogScans> scans_;
  LogFile& log_;
  std::vector<Source>& sources_;
  std::optional<std::uint32_t> pose_topic_;  // without, poses come from transforms
  std::string cloud_frame_;                  // of the first source
  std::string pose_frame_;                   // fixed frame of the poses
  std::string posed_frame_;     // whose poses come from transforms: the sensor, or a body
  std::string pose_child_;      // moving frame of the poses; empty: the sensor
  std::size_t disordered_ = 0;  // clouds whose stamp is not after that of the cloud before
  Trajectory poses_;            // of the pose topic
  TransformTree transforms_;
};

std::unique_ptr<LogScans> open_log_scans(RecordingContents& r) {
  if (!r.options.times.empty()) {
    fail(r.options.times, "expected no file of times: " + r.folder.string() + " has stamps");
  }
  return LogOpener(r).open();
}

}  // namespace dynains
