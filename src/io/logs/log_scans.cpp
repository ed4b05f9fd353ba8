#include "log_scans.hpp"

#include <algorithm>
#include <utility>

#include "decompress.hpp"
#include "dynains/errors.hpp"

namespace dynains {

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

bool LogScans::has_topic(std::uint32_t topic) const {
  return std::any_of(sources_.begin(), sources_.end(),
                     [&](const Source& source) { return source.topic == topic; });
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
