#include "dynains/io/point_bytes.hpp"

#include <cerrno>
#include <fstream>
#include <string>
#include <system_error>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"

namespace dynains {

std::vector<std::uint8_t> read_point_bytes(const std::filesystem::path& file, std::size_t count) {
  const std::string expected =
      "expected a byte for each of the scan's " + std::to_string(count) + " points";
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error == std::errc::no_such_file_or_directory) return {};
  if (error) throw IoError(file.string() + ": " + error.message() + "; " + expected);
  if (size != count) {
    throw IoError(file.string() + ": has " + std::to_string(size) + " bytes; " + expected);
  }
  std::vector<std::uint8_t> bytes(count);
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(count))) {
    throw IoError(file.string() + ": cannot be read: " + std::generic_category().message(errno));
  }
  return bytes;
}

void write_point_bytes(const std::filesystem::path& file, Span<const std::uint8_t> bytes) {
  AtomicFile out(file);
  out.stream().write(reinterpret_cast<const char*>(bytes.data()),
                     static_cast<std::streamsize>(bytes.size()));
  out.commit(AtomicFile::Sync::kLater);
}

}  // namespace dynains
