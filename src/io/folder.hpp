// A folder whose entries are reached by name and never through a link.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace dynains {

/// Device and inode: equal for two paths that lead to one file.
using FileIdentity = std::pair<dev_t, ino_t>;

/// Identity of the file or folder that `path` leads to, through links; nothing if there is none.
std::optional<FileIdentity> identity_of(const std::filesystem::path& path);

/// Creates a folder and those above it. Throws IoError.
void create_folder(const std::filesystem::path& folder);

/// An open folder. All members throw IoError with the path.
class Folder {
 public:
  enum class Kind { kFile, kFolder, kOther };
  struct Entry {
    Kind kind;  ///< of the entry itself: a link is kOther
    FileIdentity identity;
  };

  /// Links in `path` are followed.
  explicit Folder(std::filesystem::path path);
  /// Folder `name` in `parent`, which must not be a link.
  Folder(const Folder& parent, const std::string& name);
  ~Folder();
  Folder(Folder&& other) noexcept;
  Folder& operator=(Folder&& other) = delete;
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  FileIdentity identity() const;
  /// Names of all entries, sorted.
  std::vector<std::string> names() const;
  std::optional<Entry> find(const std::string& name) const;

  /// An exclusive lock excludes all others; shared ones exclude exclusive ones only.
  enum class Lock { kExclusive, kShared };
  /// Locks the folder until destruction, for all processes of this machine, without a file; on a
  /// file system without locks of folders, such as some network file systems, always. Throws
  /// UsageError for a conflicting lock.
  void lock(Lock how = Lock::kExclusive) const;
  /// Throws unless the permissions allow to make and remove entries.
  void check_changeable() const;
  /// Throws unless entry `name` can be replaced according to its attributes.
  void check_replaceable(const std::string& name) const;

  /// Makes the folder `name`. False if there is an entry of that name already.
  bool make_folder(const std::string& name) const;
  /// Does nothing if there is no such file.
  void remove_file(const std::string& name) const;
  /// False if the folder holds anything; true also if there is none.
  bool remove_folder(const std::string& name) const;

  enum class Rename {
    kNew,       ///< nothing has the new name before
    kReplace,   ///< replaces a file, or an empty folder
    kExchange,  ///< both entries exist, and change names in one step
  };
  /// Moves entry `name` to `new_name` in `target`, on the same file system. False if the file
  /// system cannot exchange entries.
  bool rename(const std::string& name, const Folder& target, const std::string& new_name,
              Rename how) const;
  /// The names of all entries are on the disk afterwards.
  void sync() const;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
};

}  // namespace dynains
