// Fields of a message of ROS, in order: their reader and their writer, and the types of the
// messages that are written.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "../byte_reader.hpp"
#include "../scalar.hpp"
#include "dynains/pose.hpp"
#include "log_file.hpp"
#include "ros_messages.hpp"

namespace dynains {

/// std_msgs/Header.
struct MessageHeader {
  double time = 0.0;  ///< s
  std::string frame;
};

/// Reads the fields of a message of ROS 1, or of ROS 2 by CDR with its alignment. The message
/// outlives it.
class MessageReader : public Bytes {
 public:
  explicit MessageReader(const SerialisedMessage& message)
      : Bytes(message.place, 0, message.data, message.size), encoding_(message.encoding) {
    if (encoding_ == MessageEncoding::kOther) fail("expected a message of ROS 1 or ROS 2");
    if (encoding_ != MessageEncoding::kCdr) return;
    const std::uint8_t* const header = take(kCdrHeader, "the header of CDR");
    if (header[0] == 0 && header[1] == 1) return;
    fail("expected plain CDR, little endian, found the representation " +
         std::to_string(header[0] * 256 + header[1]));
  }

  bool is_ros1() const { return encoding_ == MessageEncoding::kRos1; }

  template <class Number>
  Number number(const char* purpose) {
    align(sizeof(Number));
    return Bytes::number<Number>(purpose);
  }
  std::string string(const char* purpose) {
    align(sizeof(std::uint32_t));
    std::string result = Bytes::string(purpose);
    if (!is_ros1() && !result.empty() && result.back() == '\0') result.pop_back();
    return result;
  }
  /// Number of elements of a sequence, each of at least `min_size` bytes.
  std::uint32_t length(std::size_t min_size, const char* purpose) {
    const auto count = number<std::uint32_t>(purpose);
    if (count > remaining() / min_size) {
      fail("expected " + std::to_string(count) + " elements of " + purpose + ", the message ends");
    }
    return count;
  }
  /// Names of frames in old bags begin with a slash, which is left out.
  std::string frame(const char* purpose) {
    std::string name = string(purpose);
    if (!name.empty() && name.front() == '/') name.erase(0, 1);
    return name;
  }
  MessageHeader header() {
    if (is_ros1()) number<std::uint32_t>("a sequence number");
    // ROS 1 has an unsigned and ROS 2 a signed number of seconds.
    const double seconds = is_ros1() ? static_cast<double>(number<std::uint32_t>("seconds"))
                                     : static_cast<double>(number<std::int32_t>("seconds"));
    const double part = 1e-9 * static_cast<double>(number<std::uint32_t>("nanoseconds"));
    return {seconds + part, frame("a frame id")};
  }

  [[noreturn]] void fail(const std::string& what) const { dynains::fail(path(), what); }

 private:
  void align(std::size_t size) {
    const std::size_t past = is_ros1() ? 0 : (position() - kCdrHeader) % size;
    if (past != 0) skip(size - past, "padding");
  }

  MessageEncoding encoding_;
};

/// Serialises as ROS 1 does, or by CDR (little endian), where numbers are aligned to their size.
class MessageWriter : private ByteWriter {
 public:
  explicit MessageWriter(MessageEncoding encoding) : is_ros1_(encoding == MessageEncoding::kRos1) {
    if (!is_ros1_) raw(std::string("\0\1\0\0", kCdrHeader));
  }
  using ByteWriter::bytes;

  template <class Number>
  MessageWriter& number(Number value) {
    if (!is_ros1_) zeros((kCdrHeader - bytes().size()) % sizeof(value));
    ByteWriter::number(value);
    return *this;
  }
  MessageWriter& string(const std::string& text) {
    const std::size_t end = is_ros1_ ? 0 : 1;
    number(static_cast<std::uint32_t>(text.size() + end));
    return raw(std::string(text.c_str(), text.size() + end));
  }
  /// std_msgs/Header; `time`: ns.
  MessageWriter& header(std::uint64_t time, const std::string& frame) {
    if (is_ros1_) number(std::uint32_t{0});  // sequence number
    number(static_cast<std::uint32_t>(time / kSecondOfLog));
    return number(static_cast<std::uint32_t>(time % kSecondOfLog)).string(frame);
  }
  /// geometry_msgs/Pose, or a Transform.
  MessageWriter& pose(const Pose& T) {
    for (const double value : Eigen::Vector3d(T.translation())) number(value);
    for (const double value : Eigen::Vector4d(detail::Quaternion(T.linear()).coeffs()))
      number(value);
    return *this;
  }
  MessageWriter& raw(const std::string& bytes) {
    ByteWriter::raw(bytes);
    return *this;
  }

 private:
  bool is_ros1_;
};

inline constexpr const char* kCloudTopicType = "sensor_msgs/msg/PointCloud2";
inline constexpr const char* kTransformsTopicType = "tf2_msgs/msg/TFMessage";

/// A message of kTransformsTopicType with one transform; `time`: ns.
inline std::string transform_message(std::uint64_t time, const std::string& parent,
                                     const std::string& child, const Pose& T_parent_child) {
  MessageWriter out(MessageEncoding::kCdr);
  return out.number(std::uint32_t{1})
      .header(time, parent)
      .string(child)
      .pose(T_parent_child)
      .bytes();
}

/// Types of fields; the datatype of sensor_msgs/PointField is the index plus 1.
inline constexpr Scalar kFieldTypes[] = {Scalar::kInt8,   Scalar::kUint8, Scalar::kInt16,
                                         Scalar::kUint16, Scalar::kInt32, Scalar::kUint32,
                                         Scalar::kFloat,  Scalar::kDouble};
inline std::uint8_t datatype_of(Scalar type) {
  const auto* const found = std::find(std::begin(kFieldTypes), std::end(kFieldTypes), type);
  return static_cast<std::uint8_t>(found - std::begin(kFieldTypes) + 1);
}

/// A field of packed points.
struct PackedField {
  const char* name;
  Scalar type;
};

/// A message of kCloudTopicType with one row; `points`: packed; `time`: ns.
inline std::string cloud_message(std::uint64_t time, const std::string& frame,
                                 const std::vector<PackedField>& fields,
                                 const std::string& points) {
  std::uint32_t step = 0;
  for (const PackedField& field : fields) step += static_cast<std::uint32_t>(size_of(field.type));
  const auto size = static_cast<std::uint32_t>(points.size());
  MessageWriter out(MessageEncoding::kCdr);
  out.header(time, frame).number(std::uint32_t{1}).number(size / step);  // one row
  out.number(static_cast<std::uint32_t>(fields.size()));
  std::uint32_t offset = 0;
  for (const PackedField& field : fields) {
    out.string(field.name).number(offset).number(datatype_of(field.type)).number(std::uint32_t{1});
    offset += static_cast<std::uint32_t>(size_of(field.type));
  }
  out.number(std::uint8_t{0}).number(step).number(size);                // little endian
  return out.number(size).raw(points).number(std::uint8_t{1}).bytes();  // dense
}

/// Schema of a message of ROS 2, for example "tf2_msgs/msg/TFMessage"; with its definition if it is
/// one of these two.
std::shared_ptr<const LogSchema> ros2_schema(const std::string& name);

/// A topic of messages of ROS 2, of one of the types above.
LogTopic ros2_topic(const std::string& name, const std::string& type);

}  // namespace dynains
