// Atomic replacement of folders.
#pragma once

#include <filesystem>

#include "dynains/io/folder_lock.hpp"

namespace dynains {

/// Files of a folder are written into a hidden one beside it, `.NAME.dynains_staging`, which
/// `commit()` puts in place in one step. Without a commit, the destructor removes it. What a killed
/// process has left there, the next one removes. All members throw IoError.
class StagedFolder {
 public:
  /// Throws UsageError if another process writes the same folder.
  explicit StagedFolder(const std::filesystem::path& target);
  ~StagedFolder();
  StagedFolder(const StagedFolder&) = delete;
  StagedFolder& operator=(const StagedFolder&) = delete;

  /// The folder to write into.
  const std::filesystem::path& path() const { return staging_; }
  /// The target, if it is there, is removed with all that it holds.
  void commit();

 private:
  std::filesystem::path target_;
  std::filesystem::path staging_;
  FolderLock lock_;
  bool is_committed_ = false;
};

}  // namespace dynains
