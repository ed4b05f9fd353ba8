// The clouds of a log as scans, and the poses of their sensor.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/io/trajectory.hpp"
#include "dynains/pose.hpp"
#include "log_file.hpp"
#include "ros_messages.hpp"
#include "transform_tree.hpp"

namespace dynains {

/// A message of a log, of which `bytes` were read. They lose their frame of zstd, if they have one;
/// `spare` is memory for that. Throws IoError.
SerialisedMessage unpacked(const LogFile& log, const LogTopic& topic, std::uint64_t time,
                           std::vector<std::uint8_t>& bytes, std::vector<std::uint8_t>& spare);

/// Finds the cloud topic and the poses of a log. Reads it once from begin to end, checks every
/// cloud, and keeps the poses and the addresses of the clouds. Throws IoError, also if the choice
/// of a topic is not clear.
class LogScans {
 public:
  /// Without `with_poses`, poses of the log are not looked for.
  LogScans(const std::filesystem::path& path, const RecordingOptions& options, bool with_poses);

  const LogFile& log() const { return *log_; }
  std::size_t size() const { return clouds_.size(); }
  /// Places of the clouds; of topic cloud_topic(), which may have further ones.
  const std::vector<LogMessage>& clouds() const { return clouds_; }
  std::uint32_t cloud_topic() const { return cloud_topic_; }
  /// Stamps of the clouds, s, increasing.
  const std::vector<double>& times() const { return times_; }
  /// T_world_sensor (T_world_body if the extrinsic calibration is the user's), at the times of the
  /// scans that have a pose plus `time_offset`; empty without poses.
  const Trajectory& trajectory() const { return trajectory_; }
  /// As trajectory(), at all times of poses, for de-skewing.
  Trajectory motion() const;
  /// Whether the frame of the clouds is the fixed frame of the poses.
  bool is_in_world() const { return is_in_world_; }
  /// Pose of `frame` in the frame of the clouds at the time of the first one; empty if the log does
  /// not connect them.
  std::optional<Pose> T_cloud_frame(const std::string& frame) const;
  /// Names of the frames with a transform, or "none".
  std::string known_frames() const;
  /// Columns of the first cloud.
  const PointColumns& columns() const { return columns_; }
  std::size_t point_count(std::size_t i) const { return point_counts_.at(i); }
  const std::vector<std::string>& notes() const { return notes_; }
  /// Defects that results depend on.
  const std::vector<std::string>& warnings() const { return warnings_; }

  void read(std::size_t i, RecordedScan& scan);
  std::vector<std::uint32_t> read_labels(std::size_t i);

 private:
  void choose_cloud_topic();
  void choose_pose_topic();
  void read_log();
  void take_cloud(const LogMessage& message);
  void take_poses(const LogMessage& message);
  void check_clouds();
  void place_scans();
  void choose_frames();
  std::string body_frame() const;
  void fail_without_poses() const;
  void describe_extrinsic();
  std::optional<Pose> pose_at(double time) const;
  SerialisedMessage load(const LogMessage& message);

  std::unique_ptr<LogFile> log_;
  RecordingOptions options_;
  bool with_poses_;
  std::uint32_t cloud_topic_ = 0;
  std::optional<std::uint32_t> pose_topic_;  ///< without, poses come from transforms
  std::string cloud_frame_;
  std::map<std::string, std::size_t> clouds_of_frames_;  ///< of the topic
  std::string pose_frame_;                               ///< fixed frame of the poses
  std::string posed_frame_;  ///< whose poses come from transforms: the sensor, or a body
  std::string pose_child_;   ///< moving frame of the poses; empty: the sensor
  std::vector<LogMessage> clouds_;
  std::vector<double> times_;
  std::vector<std::size_t> point_counts_;
  std::size_t disordered_ = 0;  ///< clouds whose stamp is not after that of the cloud before
  PointColumns columns_;
  Trajectory poses_;  ///< of the pose topic
  TransformTree transforms_;
  bool is_in_world_ = false;
  Trajectory trajectory_;
  std::vector<std::string> notes_, warnings_;
  std::vector<std::uint8_t> bytes_;
  std::vector<std::uint8_t> compressed_;
};

}  // namespace dynains
