// Files that are read: only regular ones, and errors with the reason of the system. Readers of a
// file with position and size, and of fields in blocks of it, little endian, with every length
// checked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "failure.hpp"

namespace dynains {

/// Whether anything, a folder or a regular file is there; links are followed. Throw IoError if the
/// system cannot answer.
bool is_there(const std::filesystem::path& path);
bool is_folder(const std::filesystem::path& path);
bool is_file(const std::filesystem::path& path);

/// The extension in lower case, such as ".pcd".
std::string lower_extension(const std::filesystem::path& path);

/// Bytes of a file. Throws IoError.
std::uint64_t size_of_file(const std::filesystem::path& path);

/// All that lies directly in a folder, in no order. Throws IoError.
std::vector<std::filesystem::path> paths_in(const std::filesystem::path& folder);

/// Opens a regular file to read. Throws IoError, also for folders, and for devices and pipes, whose
/// reading may never end.
std::ifstream open_input(const std::filesystem::path& path);

class ByteReader {
 public:
  /// Throws IoError unless `path` is a regular file that opens.
  explicit ByteReader(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  std::uint64_t position() const { return position_; }
  std::uint64_t remaining() const { return size_ - position_; }
  /// Number of the last line that was read, from 1.
  std::uint64_t line() const { return line_; }

  /// Reads the next line without its end ("\n" or "\r\n"); false at the end of the file.
  /// Throws IoError for a line of more than 65536 bytes.
  bool read_line(std::string& text);

  /// Reads exactly `count` bytes. Throws IoError with `purpose` if the file ends before.
  void read(char* target, std::size_t count, const char* purpose);
  /// Reads `count` numbers.
  template <class Number>
  void read(Number* values, std::size_t count, const char* purpose) {
    read(reinterpret_cast<char*>(values), count * sizeof(Number), purpose);
  }
  std::string read_block(std::uint64_t count, const char* purpose);
  void skip(std::uint64_t count, const char* purpose);

  /// Replaces `bytes` by `count` bytes from `position` on, which become memory only if the file has
  /// them. Throws IoError with the byte.
  void read_at(std::uint64_t position, std::uint64_t count, const char* purpose,
               std::vector<std::uint8_t>& bytes);
  std::vector<std::uint8_t> read_at(std::uint64_t position, std::uint64_t count,
                                    const char* purpose) {
    std::vector<std::uint8_t> bytes;
    read_at(position, count, purpose, bytes);
    return bytes;
  }

  /// The number that `token` of the last line is. Throws IoError that expects `what`, or a number
  /// for `name`.
  std::uint64_t whole_number(std::string_view token, const std::string& what) const;
  double number(std::string_view token, const std::string& name) const;
  /// Throws IoError unless the rest of the file can hold `count` of `what`, at least `each` bytes
  /// large. The last line of a text (`is_text`) may lack its end.
  void check_room(std::uint64_t count, const char* what, std::uint64_t each,
                  bool is_text = false) const;

  [[noreturn]] void fail_here(const std::string& what) const;     ///< names the current byte
  [[noreturn]] void fail_on_line(const std::string& what) const;  ///< names the last line

 private:
  std::filesystem::path path_;
  std::ifstream file_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;  // of the stream; a seek drops what it has buffered
  std::uint64_t line_ = 0;
};

/// The bytes of a regular file, at most 64 MiB. Throws IoError.
std::string read_text_file(const std::filesystem::path& path);

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
  /// A block behind its length, uint32.
  Bytes block(const char* purpose) {
    const auto size = number<std::uint32_t>(purpose);
    return block(size, purpose);
  }
  void skip(std::uint64_t size, const char* purpose) { take(size, purpose); }
  /// The next `size` bytes.
  const std::uint8_t* take(std::uint64_t size, const char* purpose) {
    if (size > remaining()) {
      fail(std::string("expected ") + std::to_string(size) + " bytes of " + purpose + ", found " +
           std::to_string(remaining()));
    }
    const std::uint8_t* const result = data_ + position_;
    position_ += static_cast<std::size_t>(size);
    return result;
  }

  const std::filesystem::path& path() const { return path_; }
  [[noreturn]] void fail(const std::string& what) const {
    fail_at_byte(path_, origin_ + position_, what);
  }

 private:
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
