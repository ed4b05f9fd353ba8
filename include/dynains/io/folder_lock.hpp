// One writer at a time for a folder of files.
#pragma once

#include <filesystem>

namespace dynains {

/// Keeps a folder for itself, from construction to destruction, among all who take a FolderLock of
/// it: of this process or of another one on this machine. Shared locks exclude exclusive ones, not
/// each other.
///
/// The lock lies on the folder itself (flock): it leaves no file behind, and ends with the process,
/// in any way. File systems that cannot lock folders, such as some network file systems, grant
/// every lock.
class FolderLock {
 public:
  enum class Mode { kExclusive, kShared };

  /// Throws UsageError if somebody else has the folder, IoError if it cannot be opened.
  explicit FolderLock(const std::filesystem::path& folder, Mode mode = Mode::kExclusive);
  ~FolderLock();
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&& other) noexcept;
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;  // -1: moved from
};

}  // namespace dynains
