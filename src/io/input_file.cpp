#include "input_file.hpp"

#include <cerrno>
#include <string>
#include <system_error>

#include "failure.hpp"

namespace dynains {

std::ifstream open_input(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) fail(path, "is a folder, expected a file");
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) fail_by_system(path, "cannot be opened for reading", errno);
  return file;
}

void fail_to_read(const std::ifstream& file, const std::filesystem::path& path,
                  std::uint64_t position, std::uint64_t size) {
  const int reason = errno;
  const std::string what =
      "reading stopped at byte " + std::to_string(position) + " of " + std::to_string(size);
  // Without a failed call the file has become shorter.
  if (file.bad()) fail_by_system(path, what, reason);
  fail(path, what + ": the file ends there");
}

}  // namespace dynains
