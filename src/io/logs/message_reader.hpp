// Fields of a serialised message, in order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "../byte_reader.hpp"
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

}  // namespace dynains
