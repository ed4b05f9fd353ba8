// Files that appear whole or not at all.
#pragma once

#include <filesystem>
#include <memory>
#include <ostream>

namespace dynains {

/// Writes to a temporary name beside the target and renames it on `commit()`. Until then the
/// target, if it exists, stays as it was; without a commit the temporary is removed.
class AtomicFile {
 public:
  /// Opens the temporary. A symbolic link is followed: the file that it names is replaced.
  /// Throws IoError if the folder cannot be written or the target is not a regular file.
  explicit AtomicFile(std::filesystem::path target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Buffered binary stream into the temporary; `seekp(position)` works. Failures may be left to
  /// `commit()`.
  std::ostream& stream() { return stream_; }

  enum class Sync {
    kNow,   ///< the file survives a power cut from here on
    kLater  ///< faster for many files: they survive after `sync_files()`
  };

  /// Puts the file in place. Throws IoError if anything could not be written, with the reason of
  /// the first failure; the target is then untouched.
  void commit(Sync sync = Sync::kNow);

 private:
  class Buffer;

  std::filesystem::path target_;
  std::filesystem::path temporary_;
  std::unique_ptr<Buffer> buffer_;
  std::ostream stream_;
  bool committed_ = false;
};

/// Brings everything written to the file system of `folder` to its disk. Throws IoError.
void sync_files(const std::filesystem::path& folder);

}  // namespace dynains
