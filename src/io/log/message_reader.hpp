// Fields of a serialised message, in order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

#include "dynains/errors.hpp"
#include "ros_messages.hpp"

namespace dynains {

/// Reads the fields of a message of ROS 1, or of ROS 2 by CDR with its alignment.
class MessageReader {
 public:
  explicit MessageReader(const SerialisedMessage& message) : message_(message) {
    if (message.encoding == MessageEncoding::kOther) fail("expected a message of ROS 1 or ROS 2");
    if (message.encoding != MessageEncoding::kCdr) return;
    constexpr std::uint8_t kLittleEndian = 1;
    const std::uint8_t* const header = take(4, "the header of CDR");
    if (header[0] != 0 || header[1] != kLittleEndian) {
      fail("expected plain CDR, little endian, found the representation " +
           std::to_string(header[0] * 256 + header[1]));
    }
    begin_ = position_;
  }

  bool is_ros1() const { return message_.encoding == MessageEncoding::kRos1; }
  std::size_t remaining() const { return message_.size - position_; }

  template <class Number>
  Number number(const char* purpose) {
    align(sizeof(Number));
    Number value;
    std::memcpy(&value, take(sizeof(value), purpose), sizeof(value));
    return value;
  }
  std::string string(const char* purpose) {
    const auto size = number<std::uint32_t>(purpose);
    const auto* const text = reinterpret_cast<const char*>(take(size, purpose));
    std::string result(text, size);
    if (!is_ros1() && !result.empty() && result.back() == '\0') result.pop_back();
    return result;
  }
  /// Number of elements of a sequence, each of at least `least_size` bytes.
  std::uint32_t length(std::size_t least_size, const char* purpose) {
    const auto count = number<std::uint32_t>(purpose);
    if (count > remaining() / least_size) {
      fail("expected " + std::to_string(count) + " elements of " + purpose + ", the message ends");
    }
    return count;
  }
  const std::uint8_t* take(std::size_t size, const char* purpose) {
    if (size > remaining()) {
      fail("byte " + std::to_string(position_) + ": expected " + std::to_string(size) +
           " bytes of " + purpose + ", found " + std::to_string(remaining()));
    }
    const std::uint8_t* const result = message_.data + position_;
    position_ += size;
    return result;
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw IoError(message_.place + ": " + what);
  }

 private:
  void align(std::size_t size) {
    if (is_ros1()) return;
    const std::size_t past = (position_ - begin_) % size;
    if (past != 0) take(size - past, "padding");
  }

  const SerialisedMessage& message_;
  std::size_t position_ = 0;
  std::size_t begin_ = 0;  ///< alignment counts from here
};

}  // namespace dynains
