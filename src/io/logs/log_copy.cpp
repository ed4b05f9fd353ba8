#include "log_copy.hpp"

#include <cstddef>
#include <cstring>
#include <limits>
#include <vector>

#include "../failure.hpp"
#include "../scalar.hpp"
#include "log_scans.hpp"
#include "mcap_writer.hpp"
#include "message_cloud.hpp"
#include "message_fields.hpp"

namespace dynains {
namespace {

constexpr const char* kLabelField = "label";
constexpr std::uint32_t kLabelBytes = 4;  // of a point, for a label and padding

void check_count(const MessageCloud& cloud, std::size_t values) {
  if (cloud.size() == values) return;
  cloud.fail("expected " + std::to_string(values) + " points, found " +
             std::to_string(cloud.size()));
}

/// Replaces the number at byte `at`.
void put(std::size_t at, std::uint32_t value, std::string& bytes) {
  std::memcpy(bytes.data() + at, &value, sizeof(value));
}

std::string part(const SerialisedMessage& message, std::size_t begin, std::size_t end) {
  return std::string(reinterpret_cast<const char*>(message.data) + begin, end - begin);
}

/// The message with other points.
std::string with_points(const SerialisedMessage& message, const MessageCloud& cloud,
                        const std::string& points) {
  const MessageCloud::Places& at = cloud.places();
  return part(message, 0, at.data) + points + part(message, at.data_end, message.size);
}

/// Sets what lies before the points of a PointCloud2: steps and the number of their bytes.
void put_steps(const MessageCloud& cloud, std::uint32_t point_step, std::size_t row_step,
               std::size_t size, std::string& bytes) {
  const std::size_t at = cloud.places().data;
  put(at - 12, point_step, bytes);
  put(at - 8, static_cast<std::uint32_t>(row_step), bytes);
  put(at - 4, static_cast<std::uint32_t>(size), bytes);
}

}  // namespace

bool can_have_labels(const std::string& type) { return type == kPointCloud2; }

std::string without_points(const std::string& type, const SerialisedMessage& message,
                           Span<const std::uint8_t> keep) {
  const MessageCloud cloud(type, message);
  check_count(cloud, keep.size());
  std::string points;
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] == 0) continue;
    if (count++ > 0) points.append(cloud.padding(), '\0');
    points.append(reinterpret_cast<const char*>(cloud.point(i)), cloud.point_size());
  }
  std::string result = with_points(message, cloud, points);
  const MessageCloud::Places& at = cloud.places();
  if (is_livox(type)) {
    put(at.data - 12, count, result);  // before a lidar id and reserved bytes
    put(at.data - 4, count, result);
  } else {
    put_steps(cloud, cloud.point_size(), points.size(), points.size(), result);
    put(at.height, 1, result);
    put(at.height + 4, count, result);
  }
  return result;
}

std::string with_labels(const std::string& type, const SerialisedMessage& message,
                        Span<const std::uint8_t> labels) {
  if (!can_have_labels(type)) {
    fail(message.place, "expected a PointCloud2, for other types have no labels");
  }
  const MessageCloud cloud(type, message);
  check_count(cloud, labels.size());
  if (cloud.field(Role::kLabel).is_there) {
    cloud.fail("expected no field \"label\", nor labels by another name, as one is to be added");
  }
  std::string points;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    points.append(reinterpret_cast<const char*>(cloud.point(i)), cloud.point_size());
    append_number(labels[i], points);
    points.append(kLabelBytes - 1, '\0');
  }
  const std::uint32_t step = cloud.point_size() + kLabelBytes;
  std::string result = with_points(message, cloud, points);
  put_steps(cloud, step, cloud.width() * step, points.size(), result);
  MessageWriter field(message.encoding);
  const std::size_t begin = field.bytes().size();
  field.string(kLabelField).number(cloud.point_size()).number(datatype_of(Scalar::kUint8));
  field.number(std::uint32_t{1});
  put(cloud.places().height + 8, cloud.field_count() + 1, result);
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
