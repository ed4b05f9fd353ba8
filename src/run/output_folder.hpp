// Folders of results: nothing but listed files is removed, and old and new files never mix.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "dynains/io/folder_lock.hpp"
#include "folder.hpp"
#include "input_files.hpp"
#include "output_listing.hpp"

namespace dynains::program {

/// Absolute, links followed as far as there are any, and nothing behind the last name: two paths
/// are of one place if these are equal, whether it is there yet or not.
std::filesystem::path whole_path(const std::filesystem::path& path);

/// Creates a folder and those above it. Throws IoError.
void create_folder(const std::filesystem::path& folder);

/// The folder of a command's results, locked until destruction. The constructor creates it, and
/// those above it, if they are missing. The destructor removes what the constructor created and
/// what is still empty: a refused command leaves nothing behind.
class LockedFolder {
 public:
  /// Throws IoError, and UsageError if another process has locked the folder.
  explicit LockedFolder(const std::filesystem::path& folder);
  ~LockedFolder();
  LockedFolder(const LockedFolder&) = delete;
  LockedFolder& operator=(const LockedFolder&) = delete;

 private:
  std::vector<std::filesystem::path> created_;  // innermost first
  FolderLock lock_;
};

/// In a folder of results, while new results that will replace complete ones are written.
inline constexpr const char* kStagingFolder = ".dynains_staging";

/// A folder that is empty or holds earlier results of one kind, known by a marker that lists them.
/// Files that are not listed belong to others and stay. Links below the folder are never followed.
/// All members throw IoError. Make a LockedFolder of the folder first.
class OutputFolder {
 public:
  /// Throws if the folder is neither empty nor holds results that a command of this `kind` listed.
  /// Temporaries of the marker and empty folders of the kind do not count.
  OutputFolder(Folder folder, const OutputKind& kind);

  const std::filesystem::path& path() const { return folder_.path(); }
  const Folder& folder() const { return folder_; }
  const OutputKind& kind() const { return kind_; }

  bool has_results() const { return !marker_.is_null(); }
  /// Marker of the earlier results; null if there are none.
  const nlohmann::ordered_json& marker() const { return marker_; }
  const OutputListing& listing() const { return listing_; }
  /// Whether the marker has `"complete": true`.
  bool is_complete() const;
  /// New results that were not put in place, because their command was killed; null if none.
  const OutputFolder* staging() const { return staging_.get(); }

  /// Throws unless every listed file can be removed and every `planned` one written, here and in
  /// the staging folder, as far as can be known in advance. No file of others and none of `inputs`
  /// may be in the way.
  void check(const OutputListing& planned, const InputFiles& inputs) const;

  /// Replaces the marker, with this listing in the field `outputs`. It is on the disk afterwards.
  void mark(nlohmann::ordered_json marker, const OutputListing& listing);
  /// Removes listed files and temporaries of them, and folders that are empty then. The marker
  /// stays.
  void remove_results() const;
  /// As remove_results(), for one folder of the listing.
  void remove_folder_results(const std::string& name) const;
  /// Removes temporaries of listed files that killed processes left.
  void remove_temporaries() const;
  /// Moves all listed files to `target`, over files of their names.
  void move_results(const Folder& target) const;
  /// Removes the staging folder with all that it holds.
  void discard_staging();
  /// An empty staging folder with this marker.
  OutputFolder& make_staging(const nlohmann::ordered_json& marker, const OutputListing& listing);

 private:
  void check_file(const Folder& folder, const std::string& name, bool is_listed,
                  const InputFiles& inputs) const;
  void check_folder(const std::string& name, const OutputListing& planned,
                    const InputFiles& inputs) const;
  void check_nothing_foreign() const;

  Folder folder_;
  const OutputKind& kind_;
  nlohmann::ordered_json marker_;
  OutputListing listing_;
  std::unique_ptr<OutputFolder> staging_;
};

/// The change of a folder from earlier results to new ones.
///
/// In place, for results that are new or resumed: the marker says unfinished first, then files are
/// written one by one. Staged, for results that replace others: files are written into the staging
/// folder, and the earlier results stay as they are until `put_in_place()`.
class OutputChange {
 public:
  enum class Mode { kInPlace, kStaged };

  /// `marker` says unfinished and does not change until `finish()`. `planned` lists all files that
  /// will be written. Throws IoError.
  OutputChange(OutputFolder& out, Mode mode, nlohmann::ordered_json marker, OutputListing planned);
  /// Removes the staging folder, unless its files are being put in place.
  ~OutputChange();
  OutputChange(const OutputChange&) = delete;
  OutputChange& operator=(const OutputChange&) = delete;

  /// The folder to write results into.
  const std::filesystem::path& folder() const;
  bool is_staged() const { return mode_ == Mode::kStaged; }

  /// All results are on the disk and in place afterwards. `put_others()` puts files outside of the
  /// folder in place, when the marker says unfinished. Throws IoError.
  void put_in_place(const std::function<void()>& put_others = [] {});
  /// Replaces the marker by the final one. Throws IoError.
  void finish(const nlohmann::ordered_json& marker, const OutputListing& written);

 private:
  void remove_earlier();

  OutputFolder& out_;
  Mode mode_;
  nlohmann::ordered_json marker_;
  OutputListing planned_;
};

}  // namespace dynains::program
