#include "log_copy.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <limits>
#include <vector>

#include "../failure.hpp"
#include "../scalar.hpp"
#include "log_scans.hpp"
#include "mcap_writer.hpp"
#include "message_fields.hpp"
#include "point_cloud2.hpp"

namespace dynains {
namespace {

constexpr const char* kLabelField = "label";
constexpr std::uint32_t kLabelBytes = 4;  // of a point, for a label and padding

void check_count(const MessageReader& in, std::size_t points, std::size_t values) {
  if (points == values) return;
  in.fail("expected " + std::to_string(values) + " points, found " + std::to_string(points));
}

/// Replaces the number at byte `at`.
void put(std::size_t at, std::uint32_t value, std::string& bytes) {
  std::memcpy(bytes.data() + at, &value, sizeof(value));
}

std::string part(const SerialisedMessage& message, std::size_t begin, std::size_t end) {
  return std::string(reinterpret_cast<const char*>(message.data) + begin, end - begin);
}

/// The message with other points, behind their steps and the number of their bytes.
std::string with_points(const SerialisedMessage& message, const PointCloud2& cloud,
                        const std::string& points, std::uint32_t point_step, std::size_t row_step) {
  const PointCloud2::Places& at = cloud.places();
  std::string bytes = part(message, 0, at.data);
  put(at.data - 12, point_step, bytes);
  put(at.data - 8, static_cast<std::uint32_t>(row_step), bytes);
  put(at.data - 4, static_cast<std::uint32_t>(points.size()), bytes);
  return bytes + points + part(message, at.data_end, message.size);
}

std::string without_points_of_cloud(const SerialisedMessage& message,
                                    Span<const std::uint8_t> keep) {
  MessageReader in(message);
  in.header();
  const PointCloud2 cloud(in);
  check_count(in, cloud.size(), keep.size());
  std::string points;
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] == 0) continue;
    points.append(reinterpret_cast<const char*>(cloud.point(i)), cloud.point_step());
    ++count;
  }
  std::string result = with_points(message, cloud, points, cloud.point_step(), points.size());
  put(cloud.places().height, 1, result);
  put(cloud.places().height + 4, count, result);
  return result;
}

std::string without_points_of_livox(const SerialisedMessage& message,
                                    Span<const std::uint8_t> keep) {
  MessageReader in(message);
  in.header();
  check_count(in, read_livox_head(in).points, keep.size());
  const std::size_t begin = in.position();
  std::string result = part(message, 0, begin);
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    in.number<std::uint32_t>("an offset time");
    const std::size_t point = in.position() - 4;
    in.take(kLivoxPoint - 4, "a point");
    if (keep[i] == 0) continue;
    while (!in.is_ros1() && (result.size() - begin) % 4 != 0) result += '\0';
    result += part(message, point, in.position());
    ++count;
  }
  put(begin - 12, count, result);  // the number of points, before a lidar id and reserved bytes
  put(begin - 4, count, result);
  return result + part(message, in.position(), message.size);
}

}  // namespace

bool can_have_labels(const std::string& type) { return type == "sensor_msgs/PointCloud2"; }

std::string without_points(const std::string& type, const SerialisedMessage& cloud,
                           Span<const std::uint8_t> keep) {
  return can_have_labels(type) ? without_points_of_cloud(cloud, keep)
                               : without_points_of_livox(cloud, keep);
}

std::string with_labels(const std::string& type, const SerialisedMessage& message,
                        Span<const std::uint8_t> labels) {
  if (!can_have_labels(type)) {
    fail(message.place, "expected a PointCloud2, for other types have no labels");
  }
  MessageReader in(message);
  in.header();
  const PointCloud2 cloud(in);
  check_count(in, cloud.size(), labels.size());
  const std::vector<std::string>& names = cloud.field_names();
  if (std::find(names.begin(), names.end(), kLabelField) != names.end()) {
    in.fail("expected no field \"label\", which is to be added");
  }
  std::string points;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    points.append(reinterpret_cast<const char*>(cloud.point(i)), cloud.point_step());
    append_number(labels[i], points);
    points.append(kLabelBytes - 1, '\0');
  }
  const std::uint32_t step = cloud.point_step() + kLabelBytes;
  std::string result = with_points(message, cloud, points, step, cloud.width() * step);
  MessageWriter field(message.encoding);
  const std::size_t begin = field.bytes().size();
  field.string(kLabelField).number(cloud.point_step()).number(datatype_of(Scalar::kUint8));
  field.number(std::uint32_t{1});
  put(cloud.places().height + 8, static_cast<std::uint32_t>(names.size() + 1), result);
  return result.insert(cloud.places().fields_end, field.bytes(), begin);
}

void copy_log(LogFile& log, const std::filesystem::path& target, const EditMessage& edit) {
  if (log.topics().size() > std::numeric_limits<std::uint16_t>::max()) {
    fail(log.path(), "expected at most 65535 topics, for MCAP has no more");
  }
  McapWriter writer(target, log.profile(), McapWriter::Compression::kZstd);
  std::vector<std::uint16_t> channels;
  for (const LogTopic& topic : log.topics()) channels.push_back(writer.add_channel(topic));
  std::vector<std::uint8_t> bytes;
  std::vector<std::uint8_t> spare;
  for (const LogMessage& message : log.messages()) {
    const MessageStamp stamp = log.read(message, bytes);
    const SerialisedMessage serialised =
        unpacked(log, log.topics()[message.topic], message.time, bytes, spare);
    const std::optional<std::string> edited = edit(message, serialised);
    const auto* const data = reinterpret_cast<const char*>(serialised.data);
    writer.write(channels[message.topic], message.time, stamp,
                 edited ? Span<const char>(edited->data(), edited->size())
                        : Span<const char>(data, serialised.size));
  }
  log.copy_others(writer);
  writer.commit();
}

}  // namespace dynains
