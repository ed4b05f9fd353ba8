// The files that a command reads, and the recordings and results that it is given. It changes none
// of them.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <utility>

#include "dynains/io/recording.hpp"
#include "io/folder.hpp"

namespace dynains::run {

class InputFiles {
 public:
  InputFiles() = default;
  explicit InputFiles(const std::filesystem::path& path) { add(path); }
  /// A recording, and one more file, unless `file` is empty.
  explicit InputFiles(const Recording& recording, const std::filesystem::path& file = {})
      : InputFiles(file) {
    add(recording);
  }

  /// The files of a recording, and its folders: those of scans and labels take no files as outputs,
  /// and the one above them keeps the files that it has.
  void add(const Recording& recording);
  /// The folder OUT of a run.
  void add_results(const std::filesystem::path& out);
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
  /// Throws IoError if the file `name` in `folder` is a part of a recording or of results, or would
  /// be one, unless it `is_there` already.
  void refuse_part(const Folder& folder, const std::string& name, bool is_there) const;

 private:
  void add_owner(const std::filesystem::path& folder, bool has_scans);

  std::map<FileIdentity, std::filesystem::path> paths_;
  // Folders that keep their files, and whether a file with the extension of a scan would be one.
  std::map<FileIdentity, std::pair<std::filesystem::path, bool>> owners_;
};

}  // namespace dynains::run
