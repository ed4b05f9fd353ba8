// Outputs of a command: each appears whole, or not at all, and nothing of others is replaced.
//
// A command writes TARGET into the folder TARGET.partial, which it creates, locks and marks as its
// own before anything else, and renames when all is on the disk. A command that is killed leaves
// that folder, which the next one with this target replaces. Links are never followed below the
// folder that holds the target.
#pragma once

#include <filesystem>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <set>
#include <string>
#include <utility>

#include "dynains/errors.hpp"
#include "dynains/io/recording.hpp"
#include "io/folder.hpp"

namespace dynains::run {

/// Arrays and objects within each other that a JSON file may have.
inline constexpr int kMaxJsonDepth = 64;

/// Reads a JSON file. Throws IoError with path, line, column and expectation.
nlohmann::ordered_json read_json_file(const std::filesystem::path& path);

/// Text of a JSON file. Bytes that are not UTF-8, as of paths, are replaced.
std::string to_text(const nlohmann::ordered_json& json);

/// The field of `json` that `pointer` ("/static_map/file") names; nothing if there is none or if it
/// is null. Throws IoError with path, pointer and expected type for a value of another type. T is
/// bool, double or std::string. `path` is the file that `json` was read from.
template <class T>
std::optional<T> json_field(const std::filesystem::path& path, const nlohmann::ordered_json& json,
                            const std::string& pointer) {
  const nlohmann::ordered_json::json_pointer where(pointer);
  if (!json.contains(where) || json[where].is_null()) return std::nullopt;
  const nlohmann::ordered_json& value = json[where];
  const std::string kind = nlohmann::ordered_json(T()).type_name();
  if (value.type_name() == kind) return value.get<T>();
  const std::string expected = kind == "boolean" ? "true or false" : "a " + kind;
  throw IoError(path.string() + ": " + pointer + ": expected " + expected + ", found " +
                value.type_name());
}

/// A field that must exist; see json_field.
template <class T>
T required_json_field(const std::filesystem::path& path, const nlohmann::ordered_json& json,
                      const std::string& pointer) {
  if (std::optional<T> value = json_field<T>(path, json, pointer)) return *std::move(value);
  throw IoError(path.string() + ": " + pointer + ": not found; expected a value");
}

class ResultFolder;

/// The files that a command reads, and the recordings and results that it is given. It changes none
/// of them.
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
  void add_results(const std::filesystem::path& out) { add_results(out, Takes::kAny); }
  /// One that this command has locked, also for its own outputs: it takes none.
  void add_results(const ResultFolder& out);
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
  /// The new files that a folder takes.
  enum class Takes { kAny, kNoScans, kNone };

  void add_results(const std::filesystem::path& out, Takes takes);
  void add_owner(const std::filesystem::path& folder, Takes takes);

  std::map<FileIdentity, std::filesystem::path> paths_;
  // Folders that keep their files.
  std::map<FileIdentity, std::pair<std::filesystem::path, Takes>> owners_;
};

/// The name in printable ASCII: other bytes, and `%`, become `%XX`. Names need not be UTF-8.
std::string listed_name(const std::string& name);

/// Files below a folder of results; the marker is not among them. All names by listed_name().
struct OutputListing {
  std::set<std::string> files;                 ///< directly in the folder
  std::map<std::string, std::string> folders;  ///< folder -> extension of its files
  std::set<std::string> scans;                 ///< names of the files in folders, no extension

  /// Whether `folder`/`name` is listed; an empty `folder` is the folder of results itself.
  bool contains(const std::string& folder, const std::string& name) const;

  /// `{"files": [...], "folders": {...}, "scans": [...]}`.
  nlohmann::ordered_json to_json() const;
};

/// The field `outputs` of a marker. Throws IoError unless the marker is one of `dynains COMMAND`.
/// `file` is the marker's path. The names are for comparisons with entries of the folder only.
OutputListing read_listing(const std::filesystem::path& file, const nlohmann::ordered_json& marker,
                           const std::string& command);

/// Absolute, links followed as far as there are any, and nothing behind the last name: two paths
/// are of one place if these are equal, whether it is there yet or not.
std::filesystem::path whole_path(const std::filesystem::path& path);

/// Whether a file in the place of an output is replaced.
enum class Existing {
  kStays,   ///< the command is refused: --force was not given
  kForced,  ///< it is replaced, unless it is a part of what the command was given
  kOurs,    ///< it is replaced: the results that the command replaces, or adds to, have written it
  kForeign  ///< the command is refused: they have not
};
inline Existing existing_by(bool force) { return force ? Existing::kForced : Existing::kStays; }

/// The one rule for every file that a command writes: where nothing is, a new one; else in place of
/// a file that may be replaced, never of one that the command reads, of a link or of a folder.
/// Throws IoError.
Folder::Rename check_output(const Folder& folder, const std::string& name, Existing existing,
                            const InputFiles& inputs);

/// Size and fingerprint of a file, so that results know what they have written. Throws IoError.
nlohmann::ordered_json content_of(const std::filesystem::path& file);

/// Folders of results of one command, and the name of their marker: a file of JSON that names the
/// program and the command, says whether the results are complete, and lists all other files.
struct OutputKind {
  const char* command;
  const char* marker;
};
inline constexpr OutputKind kRunOutput = {"run", "report.json"};

/// The first fields of a marker: program, version, command and `"complete"`, which is false.
nlohmann::ordered_json begin_marker(const OutputKind& kind);

/// A folder of results, locked until destruction. All members throw IoError.
class ResultFolder {
 public:
  /// Throws unless the folder holds results of this kind, or nothing but temporaries of the marker;
  /// UsageError if another command has locked it. `kind` outlives this.
  ResultFolder(Folder folder, const OutputKind& kind);

  const Folder& folder() const { return folder_; }
  const std::filesystem::path& path() const { return folder_.path(); }
  std::filesystem::path marker_path() const { return path() / kind_.marker; }
  const OutputKind& kind() const { return kind_; }
  /// Null if there is none.
  const nlohmann::ordered_json& marker() const { return marker_; }
  bool has_results() const { return !marker_.is_null(); }
  /// See required_json_field().
  template <class T>
  T field(const std::string& pointer) const {
    return required_json_field<T>(marker_path(), marker_, pointer);
  }
  const OutputListing& listing() const { return listing_; }
  /// Whether the marker has `"complete": true`.
  bool is_complete() const;

  /// Throws if any file is not listed, or is one of `inputs`.
  void check(const InputFiles& inputs) const;
  /// content_of() the listed files, and a fingerprint of each listed folder, by name.
  nlohmann::ordered_json contents() const;
  /// Throws if complete results are not as they were written.
  void check_contents() const;
  /// Replaces the marker, with this listing in the field `outputs`. It is on the disk afterwards.
  void mark(nlohmann::ordered_json marker, const OutputListing& listing);
  /// Replaces the marker, and lists one more file, whose content is that of `file` of this name. A
  /// file that is not listed counts as one of the user.
  void mark_with(nlohmann::ordered_json marker, const std::filesystem::path& file);
  /// Removes the listed files, then the marker. Files of others stay.
  void remove_results() const;

 private:
  /// visit(parent, name, entry, is_ours) for all entries, those of a folder before it.
  template <class Visit>
  void visit_entries(Visit&& visit) const;
  bool is_listed(const std::string& folder, const std::string& name) const;

  Folder folder_;
  const OutputKind& kind_;
  nlohmann::ordered_json marker_;
  OutputListing listing_;
};

class OutputFile;

/// Results that wait in the folder TARGET.partial until they are whole. The destructor removes it
/// unless they are finished or kept.
class OutputFolder {
 public:
  /// `listing` has all files that will be written. Creates the folder, and those above it; what a
  /// killed command of this kind has left there is removed before. Throws IoError unless `target`
  /// is missing, empty or, if `may_replace`, holds results of this kind, all of which are listed
  /// and none of which are `inputs`, or if anything else has the name of the folder; UsageError if
  /// another command uses one of them.
  OutputFolder(const std::filesystem::path& target, const OutputKind& kind,
               const OutputListing& listing, bool may_replace, const InputFiles& inputs);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  /// The folder to write into.
  const std::filesystem::path& path() const { return results_->path(); }
  /// Whether the results that will be replaced, or complete ones that a killed command has left
  /// beside the target, have this text in `field` of their marker.
  bool had(const char* field, const std::string& text) const;
  /// kOurs if any of those results have written the file `path`, as it is now: their markers have
  /// its content_of() in the field `written`, by its listed_target().
  Existing owns(const std::filesystem::path& path) const;
  /// Also writes a file outside of the folder; one of the results that are replaced is replaced,
  /// too. Returns where to write it. Throws IoError, UsageError.
  std::filesystem::path add(const std::filesystem::path& file, const InputFiles& inputs);
  /// The results so far stay in path(), with this marker. Throws IoError.
  void keep_unfinished(const nlohmann::ordered_json& marker);
  /// Writes `marker` with "complete", the contents and the field `written` set, syncs the results,
  /// puts the added files in place, calls `put_others()`, and then replaces the target: a complete
  /// marker there means that the other outputs are in place. If any of them fails, the results stay
  /// in path(). Throws IoError.
  void finish(
      nlohmann::ordered_json marker, const std::function<void()>& put_others = [] {});

 private:
  friend class OutputFile;

  OutputFolder(const std::filesystem::path& place, const OutputKind& kind,
               const OutputListing& listing, const InputFiles& inputs,
               std::optional<ResultFolder> earlier);
  /// All bytes are on the disk before the first name changes.
  void put_files_in_place(std::list<OutputFile>::iterator first);
  /// Moves the folder to the target, in place of the results that are there, if any.
  void replace_target();
  /// Removes the folder and the results in it.
  void remove();

  Folder parent_;  // of the target
  std::string target_, name_;
  std::optional<ResultFolder> results_;
  nlohmann::ordered_json left_;  // marker of what a killed command had left; null: nothing
  std::optional<ResultFolder> earlier_;
  std::list<OutputFile> files_;  // outside of the folder
  bool is_kept_ = false;         // the folder stays as it is
};

/// A file as an output of its own, or in the folder of finished results.
class OutputFile {
 public:
  /// Throws IoError if `target` cannot be written, or by check_output(); UsageError if another
  /// command writes it or its folder.
  OutputFile(const std::filesystem::path& target, Existing existing, const InputFiles& inputs);
  /// A file of `results`, which outlive this: a new one, or in place of the listed one.
  OutputFile(const ResultFolder& results, const std::string& name);

  /// The file to write, of the name of the target.
  std::filesystem::path path() const { return partial_->path() / target_.filename(); }
  /// By whole_path().
  const std::filesystem::path& target() const { return target_; }
  std::string listed_target() const { return listed_name(target_.string()); }
  /// The file is at the target, and on the disk. If it cannot be put there, it stays in path().
  /// Calls `publish_more()` when all bytes are on the disk and only names are left to change.
  /// Throws IoError.
  void put_in_place(const std::function<void()>& publish_more = [] {});
  /// Lets `fill` write the content, and puts the file in place. Throws IoError.
  void write(const std::function<void(std::ostream&)>& fill);

 private:
  std::filesystem::path target_;
  std::optional<Folder> locked_;  // of the target
  Folder::Rename how_;
  std::unique_ptr<OutputFolder> partial_;
  const Folder* folder_ = nullptr;  // of the target
};

}  // namespace dynains::run
