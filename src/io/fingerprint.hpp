// A number that differs for two different inputs, except with a negligible probability.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

namespace dynains {

/// FNV-1a (Fowler, Noll and Vo), 64 bits.
class Fingerprint {
 public:
  void add(const void* data, std::size_t size) {
    const auto* const bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) value_ = (value_ ^ bytes[i]) * 0x100000001B3U;
  }
  /// Eight bytes at a time, for files: other numbers than those of add().
  void add_words(const char* data, std::size_t size) {
    std::size_t i = 0;
    for (std::uint64_t word = 0; i + sizeof(word) <= size; i += sizeof(word)) {
      std::memcpy(&word, data + i, sizeof(word));
      value_ = (value_ ^ word) * 0x100000001B3U;
      value_ ^= value_ >> 32U;
    }
    add(data + i, size - i);
  }
  void add(const std::string& text) { add(text.data(), text.size()); }
  void add(double value) {
    std::array<unsigned char, sizeof(value)> bytes;
    std::memcpy(bytes.data(), &value, sizeof(value));
    add(bytes.data(), bytes.size());
  }

  std::uint64_t value() const { return value_; }
  std::string text() const { return std::to_string(value_); }

 private:
  std::uint64_t value_ = 0xCBF29CE484222325U;
};

}  // namespace dynains
