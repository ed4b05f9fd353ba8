// Files that appear whole or not at all.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <ostream>
#include <string>

namespace dynains {

/// Writes to a temporary beside the target, `.NAME.0123456789abcdef.tmp` with random digits, and
/// renames it on `commit()`. Until then the target, if it exists, stays as it was; without a commit
/// the temporary is removed. The temporary is always a new file, never one that a link leads to,
/// and bears a lock (flock) until the file is in place: see `remove_leftovers()`.
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
  /// the first failure; the target is then untouched. Throws IoError as well if the file is in
  /// place, but its folder could not be brought to the disk.
  void commit(Sync sync = Sync::kNow);

 private:
  class Buffer;

  std::filesystem::path target_;
  std::filesystem::path temporary_;
  std::unique_ptr<Buffer> buffer_;
  std::ostream stream_;
  bool committed_ = false;
};

/// Name of the file that `name` is a temporary of, by its form; empty if it is none.
std::string target_of_temporary(const std::string& name);

/// Removes temporaries that killed processes left in `folder`, which must not be a link: those of
/// files for which `is_ours(NAME)` holds. A temporary that is being written stays, and so does any
/// on a file system without locks. Throws IoError.
void remove_leftovers(const std::filesystem::path& folder,
                      const std::function<bool(const std::string&)>& is_ours);

/// How many AtomicFiles of `target` are open, in this process and others; 0 on a file system
/// without locks. Throws IoError.
std::size_t count_writers(const std::filesystem::path& target);

/// Brings everything written to the file system of `folder` to its disk. Throws IoError.
void sync_files(const std::filesystem::path& folder);

}  // namespace dynains
