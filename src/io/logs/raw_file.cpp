#include "raw_file.hpp"

#include <cerrno>
#include <string>
#include <system_error>

#include "../failure.hpp"
#include "../input_file.hpp"

namespace dynains {

RawFile::RawFile(const std::filesystem::path& path) : path_(path), file_(open_input(path)) {
  std::error_code error;
  size_ = std::filesystem::file_size(path, error);
  if (error) fail(path, "cannot be read: " + error.message());
}

void RawFile::read(std::uint64_t position, std::uint64_t count, const char* purpose,
                   std::vector<std::uint8_t>& bytes) {
  if (position > size_ || count > size_ - position) {
    fail_at_byte(path_, position,
                 "expected " + std::to_string(count) + " bytes of " + purpose + ", the file has " +
                     std::to_string(position > size_ ? 0 : size_ - position));
  }
  bytes.resize(static_cast<std::size_t>(count));
  if (position != position_) file_.seekg(static_cast<std::streamoff>(position));
  errno = 0;
  file_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(count));
  position_ = position + count;
  if (!file_) fail_to_read(file_, path_, position, size_);
}

}  // namespace dynains
