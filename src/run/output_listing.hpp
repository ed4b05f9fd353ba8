// Names of the files that a command writes into its folder, as the folder's marker lists them.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

namespace dynains::program {

/// The names that a command may use: a marker that lists any other name is not ours.
struct OutputKind {
  std::string command;             ///< "run"
  std::string marker;              ///< "report.json"
  std::vector<std::string> files;  ///< beside the marker
  bool has_map;                    ///< lists a point file of any name as well
  /// Folder -> extensions that its files may have.
  std::map<std::string, std::vector<std::string>> folders;
};

/// Files below a folder of results; the marker is not among them.
struct OutputListing {
  std::set<std::string> files;                 ///< directly in the folder
  std::map<std::string, std::string> folders;  ///< folder -> extension of its files
  std::set<std::string> scans;                 ///< names of the files in folders, no extension

  /// Whether `folder`/`name` is listed; an empty `folder` is the folder of results itself.
  bool contains(const std::string& folder, const std::string& name) const;
  /// Whether everything that `other` lists is listed.
  bool contains(const OutputListing& other) const;

  /// `{"files": [...], "folders": {...}, "scans": [...]}`. Bytes of names that are not printable
  /// ASCII, and `%`, are written as `%XX`: names need not be UTF-8.
  nlohmann::ordered_json to_json() const;
};

/// The field `outputs` of a marker. Throws IoError unless the marker is one of `dynains COMMAND`
/// and lists nothing but names that the command may use. `file` is the marker's path.
OutputListing read_listing(const std::filesystem::path& file, const nlohmann::ordered_json& marker,
                           const OutputKind& kind);

}  // namespace dynains::program
