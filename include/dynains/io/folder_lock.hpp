// Lock of a folder.
#pragma once

#include <filesystem>

namespace dynains {

/// Advisory lock of a folder from construction to destruction, for all processes of this machine.
/// An exclusive lock excludes all other locks; shared locks exclude exclusive locks only.
///
/// The lock is a flock on the folder: it creates no file, and the end of the process releases it.
/// On file systems without locks of folders, such as some network file systems, each lock succeeds.
class FolderLock {
 public:
  enum class Mode { kExclusive, kShared };

  /// Throws UsageError for a conflicting lock of the folder, and IoError if it cannot be opened.
  explicit FolderLock(const std::filesystem::path& folder, Mode mode = Mode::kExclusive);
  ~FolderLock();
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&& other) noexcept;
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;  // -1 after a move
};

}  // namespace dynains
