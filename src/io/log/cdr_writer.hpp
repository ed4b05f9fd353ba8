// Fields of a message of ROS 2, in order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

namespace dynains {

/// Serialises by CDR, little endian: numbers are aligned to their size.
class CdrWriter {
 public:
  template <class Number>
  void number(Number value) {
    while ((bytes_.size() - kHeader) % sizeof(value) != 0) bytes_.push_back('\0');
    char copy[sizeof(value)];
    std::memcpy(copy, &value, sizeof(value));
    bytes_.append(copy, sizeof(value));
  }
  void string(const std::string& text) {
    number(static_cast<std::uint32_t>(text.size() + 1));
    bytes_.append(text.c_str(), text.size() + 1);
  }
  void header(std::uint64_t time, const std::string& frame) {
    constexpr std::uint64_t kSecond = 1000000000;
    number(static_cast<std::int32_t>(time / kSecond));
    number(static_cast<std::uint32_t>(time % kSecond));
    string(frame);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  static constexpr std::size_t kHeader = 4;
  std::string bytes_ = std::string("\0\1\0\0", kHeader);
};

}  // namespace dynains
