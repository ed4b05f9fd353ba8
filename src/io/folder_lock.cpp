#include "dynains/io/folder_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "dynains/errors.hpp"
#include "failure.hpp"

namespace dynains {

FolderLock::FolderLock(const std::filesystem::path& folder, Mode mode)
    : descriptor_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_ < 0) fail_by_system(folder, "cannot be opened", errno);
  int result = 0;
  do {
    result = ::flock(descriptor_, (mode == Mode::kShared ? LOCK_SH : LOCK_EX) | LOCK_NB);
  } while (result != 0 && errno == EINTR);
  if (result != 0 && errno == EWOULDBLOCK) {
    ::close(descriptor_);
    throw UsageError(folder.string() +
                     ": is in use; expected a folder that nobody else writes to at the same time");
  }
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

FolderLock::FolderLock(FolderLock&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)) {}

FolderLock& FolderLock::operator=(FolderLock&& other) noexcept {
  FolderLock taken(std::move(other));
  std::swap(descriptor_, taken.descriptor_);
  return *this;
}

}  // namespace dynains
