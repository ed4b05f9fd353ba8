// Names of the files that a command writes into its folder, as the folder's marker lists them.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

namespace dynains::run {

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

}  // namespace dynains::run
