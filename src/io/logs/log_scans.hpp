// The clouds of a log as scans, and the poses of their sensor.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "../points/point_clock.hpp"
#include "../scan_reader.hpp"
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

/// A message with points.
struct LogCloud {
  LogMessage message;
  double time = 0.0;  ///< s, stamp
  std::size_t points = 0;
};

/// Finds the clouds and the poses of a log. Reads it once from begin to end, checks every cloud,
/// and keeps the poses and the addresses of the clouds. Throws IoError, also if the choice of a
/// topic is not clear.
///
/// A scan is one cloud, or, of several topics, all clouds within half a period of the stamp of one
/// on the first topic, in the frame of that topic. Clouds without one there are a scan of their
/// own.
class LogScans final : public ScanReader {
 public:
  /// Without `with_poses`, poses of the log are not looked for.
  LogScans(const std::filesystem::path& path, const RecordingOptions& options, bool with_poses);

  const LogFile& log() const { return *log_; }
  std::size_t size() const { return scans_.size(); }
  /// The clouds of scan i, whose points follow each other in it. Their topics may have further
  /// clouds, which are no scans.
  const std::vector<LogCloud>& clouds(std::size_t i) const { return scans_.at(i); }
  /// Whether messages of this topic are clouds of scans.
  bool has_topic(std::uint32_t topic) const;
  /// Whether scans have clouds of several topics: then the times of their points are in s from the
  /// stamp of the scan.
  bool is_merged() const { return sources_.size() > 1; }
  /// Poses of the sensors in the frame of the clouds, m; empty if there is only one.
  const std::vector<Pose>& sensors() const { return sensors_; }
  /// Stamps of the scans, s, increasing.
  const std::vector<double>& times() const { return times_; }
  /// T_world_sensor (T_world_body if the extrinsic calibration is the user's), at the times of the
  /// scans that have a pose plus `time_offset`; empty without poses.
  const Trajectory& trajectory() const { return trajectory_; }
  /// As trajectory(), at all times of poses, for de-skewing.
  Trajectory motion() const;
  /// Whether the frame of the clouds is the fixed frame of the poses.
  bool is_in_world() const { return is_in_world_; }
  /// Pose of `frame` in the frame of the clouds at the time of the first one. Throws IoError if the
  /// log does not connect them.
  Pose T_cloud_frame(const std::string& frame) const;
  const std::vector<std::string>& notes() const { return notes_; }
  /// Defects that results depend on.
  const std::vector<std::string>& warnings() const { return warnings_; }

  /// Columns of the first clouds.
  PointColumns columns(const ScanEntry&) const override { return columns_; }
  std::uint64_t point_count(const ScanEntry& scan) const override;
  void read(const ScanEntry& scan, const FileTransform* T_target_file,
            RecordedScan& points) const override;
  std::vector<std::uint32_t> read_labels(const ScanEntry& scan) const override;
  const LogScans* log_scans() const override { return this; }

 private:
  /// A topic of clouds.
  struct Source {
    std::uint32_t topic = 0;
    std::string frame;                          ///< of the clouds that count
    std::map<std::string, std::size_t> frames;  ///< and numbers of all clouds
    std::vector<LogCloud> clouds;               ///< by stamp
    PointColumns columns;                       ///< of the first cloud
    Pose T_scan_cloud = Pose::Identity();       ///< from its frame to that of the first source
    std::optional<PointClock> clock;            ///< if times of points count
  };

  void choose_cloud_topics();
  void choose_pose_topic();
  void read_log();
  void take_cloud(const LogMessage& message, Source& source);
  void take_poses(const LogMessage& message);
  void check_clouds(const Source& source) const;
  void note_disordered();
  void form_scans();
  void find_sensors();
  void find_concatenated();
  void find_clocks();
  void read(const LogCloud& cloud, RecordedScan& scan) const;
  void read_sensors(double time, RecordedScan& scan) const;
  void merge(const LogCloud& cloud, double time, RecordedScan& scan) const;
  void place_scans();
  void choose_frames();
  std::string body_frame() const;
  void fail_without_poses() const;
  void refuse_conflict(const std::string& target, const std::string& source) const;
  void describe_extrinsic();
  std::optional<Pose> pose_at(double time) const;
  SerialisedMessage load(const LogMessage& message) const;

  std::unique_ptr<LogFile> log_;
  RecordingOptions options_;
  bool with_poses_;
  std::vector<Source> sources_;
  std::optional<std::uint32_t> pose_topic_;  ///< without, poses come from transforms
  std::string cloud_frame_;                  ///< of the first source
  std::string pose_frame_;                   ///< fixed frame of the poses
  std::string posed_frame_;  ///< whose poses come from transforms: the sensor, or a body
  std::string pose_child_;   ///< moving frame of the poses; empty: the sensor
  std::vector<std::vector<LogCloud>> scans_;
  std::vector<double> times_;
  std::vector<Pose> sensors_;
  std::map<double, std::vector<Concatenation::Part>> concatenations_;  ///< by stamp
  std::vector<std::string> concatenated_;  ///< frames of their sensors, in order
  std::size_t disordered_ = 0;  ///< clouds whose stamp is not after that of the cloud before
  PointColumns columns_;
  Trajectory poses_;  ///< of the pose topic
  TransformTree transforms_;
  bool is_in_world_ = false;
  Trajectory trajectory_;
  std::vector<std::string> notes_, warnings_;
  mutable std::mutex mutex_;  ///< the log has one place in its file
  mutable std::vector<std::uint8_t> bytes_, compressed_;
  mutable RecordedScan part_;
};

}  // namespace dynains
