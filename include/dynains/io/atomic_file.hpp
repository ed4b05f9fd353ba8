// Atomic replacement of files.
#pragma once

#include <filesystem>
#include <memory>
#include <ostream>
#include <string>

namespace dynains {

class FileBuffer;

/// Writes a temporary file beside the target, `.NAME.0123456789abcdef.tmp` with random digits.
/// `commit()` renames it to the target; until then, the target is unchanged. Without a commit, the
/// destructor removes the temporary file, which is always created, never opened through an existing
/// file or link.
class AtomicFile {
 public:
  /// Creates the temporary file. If `target` is a symbolic link, the file that it refers to is
  /// replaced. Throws IoError if the folder is not writable or the target is not a regular file.
  explicit AtomicFile(std::filesystem::path target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Buffered binary stream to the temporary file; supports `seekp(position)`. `commit()` reports
  /// failures of the stream.
  std::ostream& stream() { return stream_; }

  enum class Sync {
    kNow,   ///< the file is on the disk when commit() returns
    kLater  ///< the file is on the disk after `sync_files()`; faster for many files
  };

  /// Ends the stream, so that nothing but the rename is left to commit(). Throws IoError with the
  /// reason of the first failure if a write failed.
  void finish(Sync sync = Sync::kNow);

  /// finish(), and renames the temporary file to the target. If it throws IoError, the target is
  /// unchanged, except if the rename succeeded, but the synchronization of the folder failed.
  void commit(Sync sync = Sync::kNow);

 private:
  std::filesystem::path target_;
  std::filesystem::path temporary_;
  std::unique_ptr<FileBuffer> buffer_;
  std::ostream stream_;
  bool committed_ = false;
};

/// Name of the target if `name` has the form of a temporary file, else empty.
std::string target_of_temporary(const std::string& name);

/// Synchronizes the file system of `folder` with its disk. Throws IoError.
void sync_files(const std::filesystem::path& folder);

}  // namespace dynains
