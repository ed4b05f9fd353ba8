#include "log_scans.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <utility>

#include "../failure.hpp"
#include "../text.hpp"
#include "decompress.hpp"
#include "dynains/errors.hpp"
#include "dynains/median.hpp"

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
std::string list(const LogFile& log) {
  std::string text;
  for (const LogTopic& topic : log.topics()) text += (text.empty() ? "" : ", ") + text_of(topic);
  return text.empty() ? "no topic" : text;
}
std::string list(const LogFile& log, const Topics& topics) {
  std::string text;
  for (const std::uint32_t i : topics)
    text += (text.empty() ? "" : ", ") + text_of(log.topics()[i]);
  return text;
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

LogScans::LogScans(const std::filesystem::path& path, const RecordingOptions& options,
                   bool with_poses)
    : log_(open_log(path, options.accept_missing)),
      options_(options),
      with_poses_(with_poses),
      transforms_(options.pose_gap) {
  choose_cloud_topics();
  if (with_poses) choose_pose_topic();
  read_log();
  for (const Source& source : sources_) check_clouds(source);
  note_disordered();
  form_scans();
  find_sensors();
  if (is_merged()) find_clocks();
  if (with_poses) place_scans();
}

void LogScans::choose_cloud_topics() {
  const Topics clouds = filter(*log_, is_cloud_type);
  if (clouds.empty()) {
    std::string end = log_->early_end() ? "; " + *log_->early_end() : "";
    if (!filter(*log_, has_packets).empty()) {
      end +=
          "; packets of a sensor are not read: play the log through the ROS driver of the "
          "sensor, and record sensor_msgs/PointCloud2";
    }
    fail(log_->path(), "expected a topic with clouds; found " + list(*log_) + end);
  }
  std::vector<std::string> wanted = text::names_in(options_.cloud_topic);
  if (wanted.empty() && clouds.size() > 1) {
    fail(log_->path(),
         "expected one topic with clouds, or --cloud-topic; found " + list(*log_, clouds));
  }
  if (wanted.empty()) wanted.push_back(log_->topics()[clouds.front()].name);
  for (const std::string& name : wanted) {
    const auto topic = find(*log_, clouds, name);
    if (!topic) {
      fail(log_->path(), "expected clouds on topic " + name + "; found " + list(*log_, clouds));
    }
    if (has_topic(*topic)) fail(log_->path(), "expected each topic once, found " + name + " twice");
    sources_.emplace_back().topic = *topic;
    notes_.push_back("clouds from topic " + name);
  }
}

bool LogScans::has_topic(std::uint32_t topic) const {
  return std::any_of(sources_.begin(), sources_.end(),
                     [&](const Source& source) { return source.topic == topic; });
}

/// A topic of poses comes before transforms.
void LogScans::choose_pose_topic() {
  const Topics poses = filter(*log_, is_pose_type);
  const Topics direct = filter(
      *log_, [](const auto& type) { return is_pose_type(type) && !is_transform_type(type); });
  const std::string& wanted = options_.pose_topic;
  if (poses.empty()) {
    fail(log_->path(), "expected a topic with poses, or a file of poses by --poses; found " +
                           list(*log_) + "; without poses, dynains run --odometry estimates them");
  }
  std::optional<std::uint32_t> chosen = find(*log_, poses, wanted);
  if (!wanted.empty() && !chosen) {
    fail(log_->path(), "expected poses on topic " + wanted + "; found " + list(*log_, poses));
  }
  if (wanted.empty() && options_.pose_frame.empty()) {
    if (direct.size() > 1) {
      fail(log_->path(),
           "expected one topic with poses, or --pose-topic; found " + list(*log_, poses));
    }
    if (!direct.empty()) chosen = direct.front();
  }
  if (!chosen || is_transform_type(log_->topics()[*chosen].type)) {
    notes_.push_back("poses from transforms (tf)");
    return;
  }
  pose_topic_ = *chosen;
  notes_.push_back("poses from topic " + log_->topics()[*chosen].name);
}

void LogScans::read_log() {
  const auto is_wanted = [&](const LogTopic& topic) { return is_concatenation_type(topic.type); };
  const bool with_transforms = with_poses_ || is_merged() || !options_.sensor_frame.empty() ||
                               std::any_of(log_->topics().begin(), log_->topics().end(), is_wanted);
  for (const LogMessage& message : log_->messages()) {
    const LogTopic& topic = log_->topics()[message.topic];
    for (Source& source : sources_) {
      if (message.topic == source.topic) take_cloud(message, source);
    }
    if (!is_readable(topic)) continue;
    const bool is_transform = with_transforms && is_transform_type(topic.type);
    if (is_transform || message.topic == pose_topic_) take_poses(message);
    if (is_concatenation_type(topic.type)) {
      Concatenation concatenation = read_concatenation(load(message));
      concatenations_[concatenation.time] = std::move(concatenation.parts);
    }
  }
  transforms_.sort();
  sort_by_time(poses_);
}

void LogScans::take_cloud(const LogMessage& message, Source& source) {
  const SerialisedMessage serialised = load(message);
  const CloudInfo cloud = inspect_cloud(log_->topics()[message.topic].type, serialised);
  ++source.frames[cloud.frame];
  if (source.clouds.empty()) {
    source.frame = options_.cloud_frame.empty() ? cloud.frame : options_.cloud_frame;
    source.columns = cloud.columns;
  }
  if (cloud.frame != source.frame) return;
  if (!source.clouds.empty() && !(cloud.time > source.clouds.back().time)) {
    ++disordered_;
    return;
  }
  source.clouds.push_back({message, cloud.time, cloud.points});
}

void LogScans::take_poses(const LogMessage& message) {
  const LogTopic& topic = log_->topics()[message.topic];
  const bool is_static = topic.name.find("static") != std::string::npos;
  const std::string& clouds = log_->topics()[sources_.front().topic].name;
  const TransformSource source = source_of(topic.name, clouds, options_.pose_topic);
  for (const StampedPose& pose : read_poses(topic.type, load(message))) {
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

void LogScans::check_clouds(const Source& source) const {
  if (!source.clouds.empty() && (source.frames.size() == 1 || !options_.cloud_frame.empty())) {
    return;
  }
  std::vector<std::string> found;
  for (const auto& [frame, count] : source.frames) {
    found.push_back(frame + " (" + std::to_string(count) + ")");
  }
  fail(log_->path(),
       "expected clouds of one frame, or --frame-id for those of one sensor; found "
       "frames " +
           text::listed(found));
}

void LogScans::note_disordered() {
  if (disordered_ == 0) return;
  std::size_t taken = 0;
  for (const Source& source : sources_) taken += source.clouds.size();
  const std::string count = std::to_string(disordered_) + " of " +
                            std::to_string(disordered_ + taken) +
                            " clouds have a stamp that is not after that of the cloud before";
  if (disordered_ >= taken) fail(log_->path(), "expected stamps that increase: " + count);
  const bool are_many = 10 * disordered_ > taken;
  (are_many ? warnings_ : notes_).push_back(count + ", and are left out");
}

/// A cloud belongs to the nearest scan, if that is near; a sensor may be missing or come twice.
void LogScans::form_scans() {
  std::vector<double> steps;
  const std::vector<LogCloud>& first = sources_.front().clouds;
  for (std::size_t i = 1; i < first.size(); ++i) steps.push_back(first[i].time - first[i - 1].time);
  const double near = 0.5 * median(std::move(steps));
  std::map<double, std::vector<LogCloud>> scans;
  for (const Source& source : sources_) {
    const bool is_first = &source == &sources_.front();
    for (const LogCloud& cloud : source.clouds) {
      auto scan = scans.lower_bound(cloud.time);
      const bool has_before = scan != scans.begin();
      if (has_before &&
          (scan == scans.end() || cloud.time - std::prev(scan)->first < scan->first - cloud.time)) {
        --scan;
      }
      const bool is_near = scan != scans.end() && std::abs(scan->first - cloud.time) <= near;
      (is_near && !is_first ? scan->second : scans[cloud.time]).push_back(cloud);
    }
  }
  for (auto& [time, clouds] : scans) {
    times_.push_back(time);
    scans_.push_back(std::move(clouds));
  }
  cloud_frame_ = sources_.front().frame;
  columns_ = sources_.front().columns;
  for (const Source& source : sources_) {
    columns_.intensity |= source.columns.intensity;
    columns_.ring |= source.columns.ring;
    columns_.time |= source.columns.time;
    columns_.label &= source.columns.label;
  }
}

/// Several sensors are those of the options, of the topics, or of clouds that were put together
/// before they were recorded.
void LogScans::find_sensors() {
  std::vector<std::string> frames = text::names_in(options_.sensor_frame);
  if (frames.size() == 1) frames.clear();  // the origin of all
  sensors_ = options_.sensors;
  const bool are_given = !frames.empty() || !sensors_.empty();
  if (!are_given && is_merged()) {
    for (const Source& source : sources_) frames.push_back(source.frame);
  }
  for (const std::string& frame : frames) sensors_.push_back(T_cloud_frame(frame));
  if (!are_given && !is_merged()) find_concatenated();
  if (!is_merged()) return;
  if (sensors_.size() != sources_.size()) {
    throw ConfigError("expected one sensor for each of " + std::to_string(sources_.size()) +
                      " topics, found " + std::to_string(sensors_.size()));
  }
  bool are_moved = are_given;  // before they were recorded
  for (std::size_t k = 0; k < sources_.size(); ++k) {
    if (sources_[k].frame == cloud_frame_) continue;
    are_moved = true;
    sources_[k].T_scan_cloud =
        options_.sensors.empty() ? T_cloud_frame(sources_[k].frame) : sensors_[k];
  }
  if (are_moved) return;
  sensors_.clear();
  warnings_.push_back("the clouds of all topics are in frame " + cloud_frame_ +
                      ", so their beams count as those of one sensor there; --sensor-frame A,B "
                      "names the frames of the sensors");
}

/// Takes the sensors of concatenated clouds from a topic of ConcatenatedPointCloudInfo.
void LogScans::find_concatenated() {
  std::set<std::string> frames;
  for (const auto& [time, parts] : concatenations_) {
    for (const Concatenation::Part& part : parts) {
      if (part.length > 0) frames.insert(part.frame);
    }
  }
  concatenated_.assign(frames.begin(), frames.end());
  try {
    for (const std::string& frame : concatenated_) sensors_.push_back(T_cloud_frame(frame));
  } catch (const IoError& error) {
    warnings_.push_back("points of several sensors count as those of one: " +
                        std::string(error.what()));
    sensors_.clear();
    concatenated_.clear();
  }
}

/// The clocks of points, if the times of points count.
void LogScans::find_clocks() {
  if (!options_.deskew && (with_poses_ || options_.is_compensated)) return;
  for (Source& source : sources_) {
    if (!source.columns.time) continue;
    std::vector<double> times;
    for (const LogCloud& cloud : source.clouds) times.push_back(cloud.time);
    const PointClockFinding finding = find_clock(times, true, options_.point_time_unit,
                                                 [&](std::size_t i) -> const RecordedScan& {
                                                   read(source.clouds[i], part_);
                                                   return part_;
                                                 });
    const std::string& topic = log_->topics()[source.topic].name;
    if (!finding.clock && !finding.text.empty()) {
      fail(log_->path(), topic + " cannot be de-skewed: " + finding.text);
    }
    if (!finding.text.empty()) warnings_.push_back(topic + ": " + finding.text);
    source.clock = finding.clock;
  }
}

void LogScans::place_scans() {
  posed_frame_ = cloud_frame_;
  if (!pose_topic_) choose_frames();
  pose_topic_ ? refuse_conflict(pose_child_, cloud_frame_)
              : refuse_conflict(pose_frame_, posed_frame_);
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

void LogScans::refuse_conflict(const std::string& target, const std::string& source) const {
  const std::optional<std::string> conflict = transforms_.conflict(target, source);
  if (!conflict) return;
  fail(log_->path(), "expected transforms of one robot, found different ones of " + *conflict +
                         "; --pose-topic names a topic in the right one");
}

Pose LogScans::T_cloud_frame(const std::string& frame) const {
  refuse_conflict(cloud_frame_, frame);
  const auto T_cloud_frame = transforms_.find(cloud_frame_, frame, times_.front());
  if (T_cloud_frame) return *T_cloud_frame;
  fail(log_->path(), "expected a transform from frame " + cloud_frame_ +
                         " of the clouds to frame " + frame + "; found transforms of " +
                         text::listed(transforms_.frames()));
}

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
SerialisedMessage LogScans::load(const LogMessage& message) const {
  log_->read(message, bytes_);
  return unpacked(*log_, log_->topics()[message.topic], message.time, bytes_, compressed_);
}

std::uint64_t LogScans::point_count(const ScanEntry& scan) const {
  std::uint64_t count = 0;
  for (const LogCloud& cloud : clouds(scan.index)) count += cloud.points;
  return count;
}

void LogScans::read(const LogCloud& cloud, RecordedScan& scan) const {
  read_cloud(log_->topics()[cloud.message.topic].type, load(cloud.message), scan);
}

void LogScans::read(const ScanEntry& scan, const FileTransform* T_target_file,
                    RecordedScan& points) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const double time = times_[scan.index];
  if (is_merged()) {
    points.xyzi.clear();
    points.ring.clear();
    points.time.clear();
    points.sensor.clear();
    for (const LogCloud& cloud : clouds(scan.index)) merge(cloud, time, points);
  } else {
    read(clouds(scan.index).front(), points);
    read_sensors(time, points);
  }
  transform_scan(T_target_file, points);
}

/// Sensors of a concatenated cloud.
void LogScans::read_sensors(double time, RecordedScan& scan) const {
  const auto parts = concatenations_.find(time);
  if (concatenated_.empty() || parts == concatenations_.end()) return;
  scan.sensor.assign(scan.size(), 0);
  for (const Concatenation::Part& part : parts->second) {
    const auto sensor = std::lower_bound(concatenated_.begin(), concatenated_.end(), part.frame);
    const std::size_t begin = std::min(part.begin, scan.size());
    std::fill_n(scan.sensor.begin() + static_cast<std::ptrdiff_t>(begin),
                std::min(part.length, scan.size() - begin),
                static_cast<std::uint8_t>(sensor - concatenated_.begin()));
  }
}

/// Adds the points of one of several clouds. `time`: s, of the scan.
void LogScans::merge(const LogCloud& cloud, double time, RecordedScan& scan) const {
  read(cloud, part_);
  const auto is_its = [&](const Source& one) { return one.topic == cloud.message.topic; };
  const auto source = std::find_if(sources_.begin(), sources_.end(), is_its);
  for (std::size_t k = 0; k < part_.size(); ++k) {
    Eigen::Map<Eigen::Vector3f> p(part_.xyzi.data() + 4 * k);
    if (!p.isZero(0.0F)) p = (source->T_scan_cloud * p.cast<double>()).cast<float>();
    const double after = source->clock ? source->clock->after(cloud.time, part_.time[k]) : 0.0;
    scan.time.push_back(cloud.time - time + after);
  }
  scan.xyzi.insert(scan.xyzi.end(), part_.xyzi.begin(), part_.xyzi.end());
  if (columns_.ring) part_.ring.resize(part_.size());
  scan.ring.insert(scan.ring.end(), part_.ring.begin(), part_.ring.end());
  scan.sensor.resize(scan.size(), static_cast<std::uint8_t>(source - sources_.begin()));
}

std::vector<std::uint32_t> LogScans::read_labels(const ScanEntry& scan) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::uint32_t> labels;
  for (const LogCloud& cloud : clouds(scan.index)) {
    const std::string& type = log_->topics()[cloud.message.topic].type;
    const std::vector<std::uint32_t> more = read_cloud_labels(type, load(cloud.message));
    labels.insert(labels.end(), more.begin(), more.end());
  }
  return labels;
}

}  // namespace dynains
