// Fields out of a block of bytes in memory, little endian, with every length checked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "../byte_reader.hpp"
#include "../failure.hpp"

namespace dynains {

/// Sequential reader of a block that lies at byte `origin` of a file. Throws IoError with the byte.
class Bytes {
 public:
  Bytes(const std::filesystem::path& path, std::uint64_t origin, const std::uint8_t* data,
        std::size_t size)
      : path_(path), origin_(origin), data_(data), size_(size) {}

  std::size_t position() const { return position_; }
  std::size_t remaining() const { return size_ - position_; }
  const std::uint8_t* here() const { return data_ + position_; }

  template <class Number>
  Number number(const char* purpose) {
    Number value;
    std::memcpy(&value, take(sizeof(value), purpose), sizeof(value));
    return value;
  }
  std::string string(const char* purpose) {
    const auto size = number<std::uint32_t>(purpose);
    const auto* const text = reinterpret_cast<const char*>(take(size, purpose));
    return std::string(text, size);
  }
  std::string rest_as_text() const {
    return std::string(reinterpret_cast<const char*>(here()), remaining());
  }
  bool begins_with(std::string_view text) const {
    return remaining() >= text.size() && std::memcmp(here(), text.data(), text.size()) == 0;
  }
  /// The next `size` bytes as a block of their own.
  Bytes block(std::uint64_t size, const char* purpose) {
    const std::uint64_t origin = origin_ + position_;
    return Bytes(path_, origin, take(size, purpose), static_cast<std::size_t>(size));
  }
  void skip(std::uint64_t size, const char* purpose) { take(size, purpose); }

  [[noreturn]] void fail(const std::string& what) const {
    fail_at_byte(path_, origin_ + position_, what);
  }

 private:
  const std::uint8_t* take(std::uint64_t size, const char* purpose) {
    if (size > remaining()) {
      fail(std::string("expected ") + std::to_string(size) + " bytes of " + purpose + ", found " +
           std::to_string(remaining()));
    }
    const std::uint8_t* const result = data_ + position_;
    position_ += static_cast<std::size_t>(size);
    return result;
  }

  const std::filesystem::path& path_;
  std::uint64_t origin_;
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t position_ = 0;
};

/// `size` bytes of a file from `position` on, and the reader of their fields. The file outlives it.
struct FilePart {
  FilePart(ByteReader& file, std::uint64_t position, std::uint64_t size, const char* purpose)
      : bytes(file.read_at(position, size, purpose)),
        fields(file.path(), position, bytes.data(), bytes.size()) {}
  FilePart(const FilePart&) = delete;
  FilePart& operator=(const FilePart&) = delete;

  const std::vector<std::uint8_t> bytes;
  Bytes fields;
};

}  // namespace dynains
