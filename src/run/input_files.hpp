// Files and folders that a command reads, so that it never changes them.
#pragma once

#include <filesystem>
#include <map>

#include "dynains/io/recording.hpp"
#include "io/folder.hpp"

namespace dynains::program {

class InputFiles {
 public:
  InputFiles() = default;
  /// The files of a recording.
  explicit InputFiles(const Recording& recording) { add(recording); }

  void add(const Recording& recording) {
    for (const std::filesystem::path& file : recording.files()) add(file);
  }
  /// A file, or a folder that takes no files as outputs. A path that leads nowhere is left out.
  void add(const std::filesystem::path& path) {
    if (const auto identity = identity_of(path)) paths_.emplace(*identity, path);
  }

  /// Throws IoError that names both paths if `output`, the file or folder with this identity, is
  /// read.
  void refuse(const FileIdentity& identity, const std::filesystem::path& output) const;
  /// Refuses the file or folder that `output` leads to, if it exists and is read.
  void refuse(const std::filesystem::path& output) const {
    if (const auto identity = identity_of(output)) refuse(*identity, output);
  }

 private:
  std::map<FileIdentity, std::filesystem::path> paths_;
};

}  // namespace dynains::program
