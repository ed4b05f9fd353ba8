// Outputs of a command: each appears whole, or not at all, and nothing of others is replaced.
//
// A command writes the folder TARGET into TARGET.partial, which it creates, locks and marks as its
// own before anything else, and renames when all is on the disk. A command that is killed leaves
// that folder, which the next one with this target replaces. A single file is written beside its
// target, under a name that no other command uses. Links are never followed below the folder that
// holds the target.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "dynains/io/folder_lock.hpp"
#include "input_files.hpp"
#include "output_listing.hpp"

namespace dynains::program {

/// Absolute, links followed as far as there are any, and nothing behind the last name: two paths
/// are of one place if these are equal, whether it is there yet or not.
std::filesystem::path whole_path(const std::filesystem::path& path);

/// Creates a folder and those above it. Throws IoError.
void create_folder(const std::filesystem::path& folder);

/// Folders of results of one command, and the name of their marker: a file of JSON that names the
/// program and the command, says whether the results are complete, and lists all other files.
struct OutputKind {
  std::string command;  ///< "run"
  std::string marker;   ///< "report.json"
};

/// The first fields of a marker: program, version, command and `"complete"`, which is false.
nlohmann::ordered_json begin_marker(const OutputKind& kind);

/// A folder of results, locked until destruction. All members throw IoError.
class ResultFolder {
 public:
  /// Throws unless the folder holds results of this kind, or nothing but temporaries of the marker;
  /// UsageError if another command has locked it. `kind` outlives this.
  ResultFolder(std::filesystem::path folder, const OutputKind& kind);

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path marker_path() const { return path_ / kind_.marker; }
  /// Null if there is none.
  const nlohmann::ordered_json& marker() const { return marker_; }
  bool has_results() const { return !marker_.is_null(); }
  const OutputListing& listing() const { return listing_; }

  /// Throws if any file is not listed, or is one of `inputs`.
  void check(const InputFiles& inputs) const;
  /// Replaces the marker, with this listing in the field `outputs`. It is on the disk afterwards.
  void mark(nlohmann::ordered_json marker, OutputListing listing);
  /// Removes the listed files, and at last the marker. Files of others stay.
  void remove_results() const;
  /// The folder has got another name.
  void was_moved_to(std::filesystem::path path) { path_ = std::move(path); }

 private:
  struct Entry {
    std::filesystem::path path;
    bool is_ours;
  };
  /// All entries, those of a listed folder before it.
  std::vector<Entry> entries() const;
  bool is_listed(const std::string& folder, const std::filesystem::directory_entry& entry) const;

  std::filesystem::path path_;
  std::optional<FileIdentity> identity_;  ///< before the lock
  FolderLock lock_;
  const OutputKind& kind_;
  nlohmann::ordered_json marker_;
  OutputListing listing_;
};

/// Results in a folder.
class OutputFolder {
 public:
  /// `listing` has all files that will be written. Throws IoError unless `target` is missing, empty
  /// or, if `may_replace`, holds results of this kind, all of which are listed and none of which
  /// are `inputs`; UsageError if another command uses it.
  OutputFolder(const std::filesystem::path& target, const OutputKind& kind, OutputListing listing,
               bool may_replace, const InputFiles& inputs);
  /// Removes the folder unless it was kept or put in place.
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  /// The folder to write into.
  const std::filesystem::path& path() const { return partial_->path(); }
  /// Whether the results that will be replaced, or complete ones that a killed command has left
  /// beside the target, have this text in `field` of their marker.
  bool earlier_have(const char* field, const std::string& text) const;
  /// The results so far stay in path(), with this marker. Throws IoError.
  void keep_unfinished(const nlohmann::ordered_json& marker);
  /// Writes `marker` with "complete" set, syncs the results, and calls `put_others()`. At last it
  /// puts the results in the place of the target, whose marker says that everything is in place. If
  /// `put_others()` fails, the results stay in path(). Throws IoError.
  void finish(
      nlohmann::ordered_json marker, const std::function<void()>& put_others = [] {});

 private:
  void put_in_place();

  std::filesystem::path target_;
  OutputListing listing_;
  std::optional<ResultFolder> earlier_;
  std::optional<ResultFolder> partial_;
  nlohmann::ordered_json left_;  ///< marker of what a killed command had left; null: nothing
  bool is_kept_ = false;
};

/// A file as an output of its own.
class OutputFile {
 public:
  /// Throws IoError if `target` cannot be written, is one of `inputs`, or exists and must not be
  /// replaced.
  OutputFile(const std::filesystem::path& target, bool may_replace, const InputFiles& inputs);
  /// Removes the file unless it was put in place.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// The file to write, with the ending of the target.
  const std::filesystem::path& path() const { return path_; }
  /// The file is at the target, and on the disk. If it cannot be put there, it stays in path().
  /// Throws IoError.
  void put_in_place();

 private:
  std::filesystem::path target_;  // by whole_path()
  std::filesystem::path path_;
  bool replaces_ = false;
  bool is_kept_ = false;
};

}  // namespace dynains::program
