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
#include "dynains/pose.hpp"
#include "log_file.hpp"
#include "ros_messages.hpp"

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

/// Reads the clouds of a log. A scan is one cloud, or, of several topics, all clouds within half a
/// period of the stamp of one on the first topic, in the frame of that topic. Clouds without one
/// there are a scan of their own.
class LogScans final : public ScanReader {
 public:
  explicit LogScans(std::unique_ptr<LogFile> log) : log_(std::move(log)) {}

  const LogFile& log() const { return *log_; }
  /// The clouds of scan i, whose points follow each other in it. Their topics may have further
  /// clouds, which are no scans.
  const std::vector<LogCloud>& clouds(std::size_t i) const { return scans_.at(i); }
  /// Whether messages of this topic are clouds of scans.
  bool has_topic(std::uint32_t topic) const;
  /// Whether scans have clouds of several topics: then the times of their points are in s from the
  /// stamp of the scan.
  bool is_merged() const { return sources_.size() > 1; }

  /// Columns of the first clouds.
  PointColumns columns(const ScanEntry&) const override { return columns_; }
  std::uint64_t point_count(const ScanEntry& scan) const override;
  void read(const ScanEntry& scan, const FileTransform* T_target_file,
            RecordedScan& points) const override;
  std::vector<std::uint32_t> read_labels(const ScanEntry& scan) const override;
  const LogScans* log_scans() const override { return this; }

 private:
  friend class LogOpener;

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

  SerialisedMessage load(const LogMessage& message) const;
  void read(const LogCloud& cloud, RecordedScan& scan) const;
  void read_sensors(double time, RecordedScan& scan) const;
  void merge(const LogCloud& cloud, double time, RecordedScan& scan) const;

  std::unique_ptr<LogFile> log_;
  std::vector<Source> sources_;
  std::vector<std::vector<LogCloud>> scans_;
  PointColumns columns_;
  std::map<double, std::vector<Concatenation::Part>> concatenations_;  ///< by stamp
  std::vector<std::string> concatenated_;  ///< frames of their sensors, in order
  mutable std::mutex mutex_;               ///< the log has one place in its file
  mutable std::vector<std::uint8_t> bytes_, compressed_;
  mutable RecordedScan part_;
};

/// Opens the log of a recording, and gives it scans, times and poses: those of a file belong to the
/// clouds by time. Reads the log once from begin to end, checks every cloud, and keeps the poses
/// and the addresses of the clouds. Throws IoError, also if the choice of a topic is not clear.
std::unique_ptr<LogScans> open_log_scans(RecordingContents& r);

}  // namespace dynains
