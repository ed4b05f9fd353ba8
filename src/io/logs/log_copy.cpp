#include "log_copy.hpp"

#include <cstddef>
#include <cstring>
#include <limits>
#include <vector>

#include "../failure.hpp"
#include "../scalar.hpp"
#include "log_scans.hpp"
#include "mcap_writer.hpp"
#include "message_reader.hpp"
#include "message_writer.hpp"
#include "point_cloud2.hpp"

namespace dynains {
namespace {

constexpr const char* kLabelField = "label";
constexpr std::uint32_t kLabelBytes = 4;  // of a point, for a label and padding

void skip_header(MessageReader& in) {
  if (in.is_ros1()) in.number<std::uint32_t>("a sequence number");
  in.number<std::uint32_t>("seconds");
  in.number<std::uint32_t>("nanoseconds");
  in.string("a frame id");
}

void check_count(const MessageReader& in, std::size_t points, std::size_t values) {
  if (points == values) return;
  in.fail("expected " + std::to_string(values) + " points, found " + std::to_string(points));
}

/// Replaces the number at byte `at`.
void put(std::size_t at, std::uint32_t value, std::string& bytes) {
  std::memcpy(bytes.data() + at, &value, sizeof(value));
}

/// Bytes of a serialised PointCloud2.
class CloudBytes {
 public:
  explicit CloudBytes(const SerialisedMessage& message)
      : message_(message), in_(message), cloud_(behind_header()) {
    find_fields();
    data_ = static_cast<std::size_t>(cloud_.data() - message.data);
  }

  const MessageReader& reader() const { return in_; }
  const PointCloud2& cloud() const { return cloud_; }
  bool has_labels() const { return has_labels_; }

  /// Everything before the points, with another number of their bytes.
  std::string head(std::size_t size) const {
    std::string bytes = part(0, data_);
    put(data_ - 4, static_cast<std::uint32_t>(size), bytes);
    return bytes;
  }
  void put_rows(std::uint32_t height, std::uint32_t width, std::string& head) const {
    put(height_, height, head);
    put(height_ + 4, width, head);
  }
  void put_steps(std::uint32_t point, std::uint32_t row, std::string& head) const {
    put(data_ - 12, point, head);
    put(data_ - 8, row, head);
  }
  /// Adds the field of labels to what put_rows() and put_steps() have completed.
  void add_label_field(std::string& head) const {
    MessageWriter field(message_.encoding);
    const std::size_t begin = field.bytes().size();
    field.string(kLabelField);
    field.number(cloud_.point_step());
    field.number(datatype_of(Scalar::kUint8));
    field.number(std::uint32_t{1});
    put(height_ + 8, fields_ + 1, head);
    head.insert(fields_end_, field.bytes(), begin);
  }
  /// Everything behind the points.
  std::string tail() const {
    std::uint32_t size = 0;
    std::memcpy(&size, message_.data + data_ - 4, sizeof(size));
    return part(data_ + size, message_.size);
  }

 private:
  MessageReader& behind_header() {
    skip_header(in_);
    return in_;
  }
  std::string part(std::size_t begin, std::size_t end) const {
    return std::string(reinterpret_cast<const char*>(message_.data) + begin, end - begin);
  }
  void find_fields() {
    MessageReader in(message_);
    skip_header(in);
    in.number<std::uint32_t>("a height");
    height_ = message_.size - in.remaining() - 4;
    in.number<std::uint32_t>("a width");
    fields_ = in.number<std::uint32_t>("a number of fields");
    for (std::uint32_t i = 0; i < fields_; ++i) {
      has_labels_ = in.string("a field name") == kLabelField || has_labels_;
      in.number<std::uint32_t>("a field offset");
      in.number<std::uint8_t>("a field datatype");
      in.number<std::uint32_t>("a field count");
    }
    fields_end_ = message_.size - in.remaining();
  }

  const SerialisedMessage& message_;
  MessageReader in_;
  PointCloud2 cloud_;
  // Bytes of the message.
  std::size_t height_ = 0;  ///< of the height; the width and the number of fields follow
  std::size_t fields_end_ = 0;
  std::size_t data_ = 0;
  std::uint32_t fields_ = 0;
  bool has_labels_ = false;
};

std::string without_points_of_cloud(const SerialisedMessage& message,
                                    Span<const std::uint8_t> keep) {
  const CloudBytes bytes(message);
  const PointCloud2& cloud = bytes.cloud();
  check_count(bytes.reader(), cloud.size(), keep.size());
  std::string points;
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] == 0) continue;
    points.append(reinterpret_cast<const char*>(cloud.point(i)), cloud.point_step());
    ++count;
  }
  std::string result = bytes.head(points.size());
  bytes.put_rows(1, count, result);
  bytes.put_steps(cloud.point_step(), static_cast<std::uint32_t>(points.size()), result);
  return result + points + bytes.tail();
}

std::string without_points_of_livox(const SerialisedMessage& message,
                                    Span<const std::uint8_t> keep) {
  MessageReader in(message);
  skip_header(in);
  const auto here = [&] { return message.size - in.remaining(); };
  in.number<std::uint64_t>("a time base");
  in.number<std::uint32_t>("a number of points");
  const std::size_t number_of_points = here() - 4;
  in.take(4, "a lidar id and reserved bytes");
  check_count(in, in.length(kLivoxPoint, "points"), keep.size());
  const std::size_t begin = here();
  std::string result(reinterpret_cast<const char*>(message.data), begin);
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    in.number<std::uint32_t>("an offset time");
    const std::uint8_t* const point = message.data + here() - 4;
    in.take(kLivoxPoint - 4, "a point");
    if (keep[i] == 0) continue;
    while (!in.is_ros1() && (result.size() - begin) % 4 != 0) result += '\0';
    result.append(reinterpret_cast<const char*>(point), kLivoxPoint);
    ++count;
  }
  put(number_of_points, count, result);
  put(begin - 4, count, result);
  return result.append(reinterpret_cast<const char*>(message.data) + here(), in.remaining());
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
    throw IoError(message.place + ": expected a PointCloud2, for other types have no labels");
  }
  const CloudBytes bytes(message);
  const PointCloud2& cloud = bytes.cloud();
  check_count(bytes.reader(), cloud.size(), labels.size());
  if (bytes.has_labels()) bytes.reader().fail("expected no field \"label\", which is to be added");
  std::string points;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    points.append(reinterpret_cast<const char*>(cloud.point(i)), cloud.point_step());
    append_number(labels[i], points);
    points.append(kLabelBytes - 1, '\0');
  }
  const std::uint32_t step = cloud.point_step() + kLabelBytes;
  std::string result = bytes.head(points.size());
  bytes.put_steps(step, cloud.width() * step, result);
  bytes.add_label_field(result);
  return result + points + bytes.tail();
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
