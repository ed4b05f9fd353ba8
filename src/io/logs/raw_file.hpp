// Random access to the bytes of a file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <vector>

namespace dynains {

/// Every length is compared with the size of the file before memory is allocated for it. Throws
/// IoError with the byte.
class RawFile {
 public:
  /// Throws unless `path` is a regular file that opens.
  explicit RawFile(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }

  /// Replaces `bytes` by `count` bytes from `position` on. `purpose` names them in errors.
  void read(std::uint64_t position, std::uint64_t count, const char* purpose,
            std::vector<std::uint8_t>& bytes);
  std::vector<std::uint8_t> read(std::uint64_t position, std::uint64_t count, const char* purpose) {
    std::vector<std::uint8_t> bytes;
    read(position, count, purpose, bytes);
    return bytes;
  }

 private:
  std::filesystem::path path_;
  std::ifstream file_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;  ///< of the stream; a seek drops what it has buffered
};

}  // namespace dynains
