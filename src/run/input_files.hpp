// Files and folders that a command reads, so that it never changes them.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <map>
#include <optional>
#include <utility>

namespace dynains::program {

/// Device and inode: equal for two paths that lead to one file.
using FileIdentity = std::pair<dev_t, ino_t>;

/// Identity of the file or folder that `path` leads to, through links; nothing if there is none.
std::optional<FileIdentity> identity_of(const std::filesystem::path& path);

class InputFiles {
 public:
  /// A file, or a folder whose list of entries is read. A path that leads nowhere is left out.
  void add(const std::filesystem::path& path) {
    if (const auto identity = identity_of(path)) paths_.emplace(*identity, path);
  }
  /// Throws IoError that names both paths if the file or folder that `output` leads to is read.
  void refuse(const std::filesystem::path& output) const;

 private:
  std::map<FileIdentity, std::filesystem::path> paths_;
};

}  // namespace dynains::program
