#include "folder.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <memory>

#include "dynains/errors.hpp"
#include "failure.hpp"

namespace dynains {

std::optional<FileIdentity> identity_of(const std::filesystem::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  return FileIdentity(status.st_dev, status.st_ino);
}

void create_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) fail(folder, "cannot be created: " + error.message());
}

Folder::Folder(std::filesystem::path path)
    : path_(std::move(path)),
      descriptor_(::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_ < 0) fail_by_system(path_, "cannot be opened", errno);
}

Folder::Folder(const Folder& parent, const std::string& name)
    : path_(parent.path_ / name),
      descriptor_(::openat(parent.descriptor_, name.c_str(),
                           O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC)) {
  if (descriptor_ >= 0) return;
  if (errno == ELOOP || errno == ENOTDIR) {
    fail(path_, "is a link or a file; expected a folder or nothing there");
  }
  fail_by_system(path_, "cannot be opened", errno);
}

Folder::~Folder() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Folder::Folder(Folder&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

FileIdentity Folder::identity() const {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) fail_by_system(path_, "cannot be examined", errno);
  return {status.st_dev, status.st_ino};
}

std::vector<std::string> Folder::names() const {
  // A second descriptor, because readdir() moves the position of the one that it is given.
  const int descriptor = ::openat(descriptor_, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const std::unique_ptr<DIR, int (*)(DIR*)> entries(
      descriptor < 0 ? nullptr : ::fdopendir(descriptor), ::closedir);
  if (!entries) fail_by_system(path_, "cannot be listed", errno);
  std::vector<std::string> names;
  while (true) {
    errno = 0;
    const dirent* const entry = ::readdir(entries.get());
    if (entry == nullptr) break;
    const std::string name = entry->d_name;
    if (name != "." && name != "..") names.push_back(name);
  }
  if (errno != 0) fail_by_system(path_, "cannot be listed", errno);
  std::sort(names.begin(), names.end());
  return names;
}

std::optional<Folder::Entry> Folder::find(const std::string& name) const {
  struct stat status {};
  if (::fstatat(descriptor_, name.c_str(), &status, AT_SYMLINK_NOFOLLOW) != 0) {
    if (errno == ENOENT) return std::nullopt;
    fail_by_system(path_ / name, "cannot be examined", errno);
  }
  const Kind kind = S_ISREG(status.st_mode)   ? Kind::kFile
                    : S_ISDIR(status.st_mode) ? Kind::kFolder
                                              : Kind::kOther;
  return Entry{kind, {status.st_dev, status.st_ino}};
}

void Folder::lock(Lock how) const {
  int result = 0;
  do {
    result = ::flock(descriptor_, (how == Lock::kShared ? LOCK_SH : LOCK_EX) | LOCK_NB);
  } while (result != 0 && errno == EINTR);
  if (result != 0 && errno == EWOULDBLOCK) {
    throw UsageError(path_.string() +
                     ": is in use; expected a folder that nobody else writes to at the same time");
  }
}

void Folder::check_changeable() const {
  if (::faccessat(descriptor_, ".", W_OK | X_OK, AT_EACCESS) == 0) return;
  fail_by_system(path_, "cannot be changed", errno);
}

void Folder::check_replaceable(const std::string& name) const {
  struct statx status {};
  struct stat folder {};
  if (::statx(descriptor_, name.c_str(), AT_SYMLINK_NOFOLLOW, STATX_BASIC_STATS, &status) != 0 ||
      ::fstat(descriptor_, &folder) != 0) {
    fail_by_system(path_ / name, "cannot be examined", errno);
  }
  const uid_t user = ::geteuid();
  const bool is_of_others = (folder.st_mode & S_ISVTX) != 0 && user != 0 && user != folder.st_uid &&
                            user != status.stx_uid;
  const bool is_protected =
      (status.stx_attributes & (STATX_ATTR_IMMUTABLE | STATX_ATTR_APPEND)) != 0;
  if (is_of_others || is_protected) fail_by_system(path_ / name, "cannot be replaced", EPERM);
  if ((status.stx_attributes & STATX_ATTR_MOUNT_ROOT) != 0) {
    fail(path_ / name, "is mounted and cannot be replaced; choose a folder in it");
  }
}

void Folder::remove_file(const std::string& name) const {
  if (::unlinkat(descriptor_, name.c_str(), 0) != 0 && errno != ENOENT) {
    fail_by_system(path_ / name, "cannot be removed", errno);
  }
}

bool Folder::remove_folder(const std::string& name) const {
  if (::unlinkat(descriptor_, name.c_str(), AT_REMOVEDIR) == 0 || errno == ENOENT) return true;
  if (errno == ENOTEMPTY || errno == EEXIST) return false;
  fail_by_system(path_ / name, "cannot be removed", errno);
}

bool Folder::make_folder(const std::string& name) const {
  if (::mkdirat(descriptor_, name.c_str(), 0777) == 0) return true;
  if (errno != EEXIST) fail_by_system(path_ / name, "cannot be created", errno);
  return false;
}

bool Folder::rename(const std::string& name, const Folder& target, const std::string& new_name,
                    Rename how) const {
  const unsigned flags = how == Rename::kNew        ? RENAME_NOREPLACE
                         : how == Rename::kExchange ? RENAME_EXCHANGE
                                                    : 0U;
  const auto try_with = [&](unsigned with) {
    return ::renameat2(descriptor_, name.c_str(), target.descriptor_, new_name.c_str(), with) == 0;
  };
  if (try_with(flags)) return true;
  // Some file systems know plain renames only.
  const bool is_unknown = flags != 0 && (errno == EINVAL || errno == ENOSYS);
  if (is_unknown && how == Rename::kExchange) return false;
  if (is_unknown && !target.find(new_name) && try_with(0)) return true;
  fail_by_system(target.path_ / new_name, "cannot be put in place", errno);
}

void Folder::sync() const {
  // Some file systems cannot sync folders.
  if (::fsync(descriptor_) != 0 && errno != EINVAL) {
    fail_by_system(path_, "cannot be written to the disk", errno);
  }
}

}  // namespace dynains
