// The clouds of a log as scans, and the poses of their sensor.
#pragma once

#include <algorithm>
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
  bool has_topic(std::uint32_t topic) const {
    return std::any_of(sources_.begin(), sources_.end(),
                       [&](const Source& source) { return source.topic == topic; });
  }
  /// Whether scans have clouds of several topics: then the times of their points are in s from the
  /// stamp of the scan.
  bool is_merged() const { return sources_.size() > 1; }

  /// Columns of the first clouds.
  PointColumns columns(const ScanEntry&) const override { return columns_; }
  std::uint64_t point_count(const ScanEntry& scan) const override {
    std::uint64_t count = 0;
    for (const LogCloud& cloud : clouds(scan.index)) count += cloud.points;
    return count;
  }
  void read(const ScanEntry& scan, const FileTransform* T_target_file,
            RecordedScan& points) const override {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (is_merged()) {
      points.xyzi.clear();
      points.ring.clear();
      points.time.clear();
      points.sensor.clear();
      for (const LogCloud& cloud : clouds(scan.index)) merge(cloud, scan.time, points);
    } else {
      read(clouds(scan.index).front(), points);
      read_sensors(scan.time, points);
    }
    transform_scan(T_target_file, points);
  }
  std::vector<std::uint32_t> read_labels(const ScanEntry& scan) const override {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::vector<std::uint32_t> labels;
    for (const LogCloud& cloud : clouds(scan.index)) {
      const std::string& type = log_->topics()[cloud.message.topic].type;
      const std::vector<std::uint32_t> more = read_cloud_labels(type, load(cloud.message));
      labels.insert(labels.end(), more.begin(), more.end());
    }
    return labels;
  }
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

  /// The message, in memory until the next one.
  SerialisedMessage load(const LogMessage& message) const {
    log_->read(message, bytes_);
    return unpacked(*log_, log_->topics()[message.topic], message.time, bytes_, compressed_);
  }
  void read(const LogCloud& cloud, RecordedScan& scan) const {
    read_cloud(log_->topics()[cloud.message.topic].type, load(cloud.message), scan);
  }
  /// Sensors of a concatenated cloud.
  void read_sensors(double time, RecordedScan& scan) const {
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
  void merge(const LogCloud& cloud, double time, RecordedScan& scan) const {
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
