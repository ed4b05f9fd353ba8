#include "input_file.hpp"

#include <cerrno>
#include <system_error>

#include "failure.hpp"

namespace dynains {

namespace {

namespace fs = std::filesystem;

fs::file_status status_of(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::status_known(status)) fail_by_system(path, "cannot be read", error.value());
  return status;
}

}  // namespace

bool is_there(const fs::path& path) { return fs::exists(status_of(path)); }

bool is_folder(const fs::path& path) { return fs::is_directory(status_of(path)); }

bool is_file(const fs::path& path) { return fs::is_regular_file(status_of(path)); }

std::uint64_t size_of_file(const fs::path& path) {
  std::error_code error;
  const std::uint64_t size = fs::file_size(path, error);
  if (error) fail(path, "cannot be read: " + error.message());
  return size;
}

std::vector<fs::path> paths_in(const fs::path& folder) {
  std::vector<fs::path> paths;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    paths.push_back(entry->path());
  }
  if (error) fail(folder, "cannot be listed: " + error.message());
  return paths;
}

std::ifstream open_input(const fs::path& path) {
  const fs::file_status status = status_of(path);
  if (!fs::exists(status)) fail_by_system(path, "cannot be read", ENOENT);
  if (fs::is_directory(status)) fail(path, "cannot be read: is a folder; expected a file");
  if (!fs::is_regular_file(status)) {
    fail(path, "cannot be read: is a device or a pipe; expected a file");
  }
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) fail_by_system(path, "cannot be opened for reading", errno);
  return file;
}

}  // namespace dynains
