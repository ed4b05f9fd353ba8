// A file that is written once, from its begin to its end.
#pragma once

#include <fcntl.h>

#include <filesystem>
#include <string>
#include <utility>

#include "dynains/points.hpp"
#include "failure.hpp"
#include "file_buffer.hpp"

namespace dynains {

/// Writes a file, new or emptied, by few large system calls. Errors throw IoError and name file and
/// cause.
class NewFile {
 public:
  explicit NewFile(std::filesystem::path path)
      : path_(std::move(path)),
        buffer_(
            ::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666)) {
    check("cannot be written");
  }
  void write(Span<const char> bytes) {
    buffer_.sputn(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    check("cannot be written to the end");
  }
  void close() {
    buffer_.pubsync();
    buffer_.check_close();
    check("cannot be written to the end");
  }

 private:
  void check(const char* what) const {
    if (buffer_.error() != 0) fail_by_system(path_, what, buffer_.error());
  }

  std::filesystem::path path_;
  FileBuffer buffer_;
};

inline void write_file(const std::filesystem::path& path, Span<const char> bytes) {
  NewFile file(path);
  file.write(bytes);
  file.close();
}

}  // namespace dynains
