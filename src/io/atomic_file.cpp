#include "dynains/io/atomic_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "dynains/errors.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const char* what, int error) {
  std::string text = path.string() + ": " + what;
  if (error != 0) text += ": " + std::generic_category().message(error);
  throw IoError(text);
}

/// The file that will be replaced: renaming over a link would cut it off from its target.
fs::path follow_links(fs::path path) {
  std::error_code error;
  if (!fs::is_symlink(path, error)) return path;
  fs::path resolved = fs::weakly_canonical(path, error);
  return error ? path : resolved;
}

}  // namespace

AtomicFile::AtomicFile(fs::path target) : target_(follow_links(std::move(target))) {
  std::error_code error;
  const fs::file_status status = fs::status(target_, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    fail(target_, "cannot be replaced: expected a regular file or none", 0);
  }
  temporary_ = target_;
  temporary_.replace_filename("." + target_.filename().string() + "." + std::to_string(::getpid()) +
                              ".tmp");
  errno = 0;
  stream_.open(temporary_, std::ios::binary | std::ios::trunc);
  if (!stream_) fail(target_, "cannot be written", errno);
}

AtomicFile::~AtomicFile() {
  if (committed_) return;
  stream_.close();
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

void AtomicFile::commit() {
  errno = 0;
  stream_.flush();
  if (stream_) stream_.close();
  if (!stream_) fail(target_, "cannot be written to the end", errno);

  // Without this, a power cut after the rename can leave an empty file under the final name.
  const int descriptor = ::open(temporary_.c_str(), O_WRONLY | O_CLOEXEC);
  if (descriptor < 0) fail(target_, "cannot be written to the disk", errno);
  const int synced = ::fsync(descriptor);
  const int sync_error = errno;
  ::close(descriptor);
  // Some file systems cannot sync single files (EINVAL); the rename is still atomic there.
  if (synced != 0 && sync_error != EINVAL) {
    fail(target_, "cannot be written to the disk", sync_error);
  }

  std::error_code error;
  fs::rename(temporary_, target_, error);
  if (error) fail(target_, "cannot be put in place", error.value());
  committed_ = true;
}

}  // namespace dynains
