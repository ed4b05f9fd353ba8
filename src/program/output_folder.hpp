// Folders that results go to: old and new files never mix.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace dynains::program {

/// Absolute, links followed as far as there are any, and nothing behind the last name: two paths
/// are of one place if these are equal, whether it is there yet or not.
std::filesystem::path whole_path(const std::filesystem::path& path);

/// Creates a folder and those above it. Throws IoError.
void create_folder(const std::filesystem::path& folder);

/// What a command writes into its folder.
struct OutputFiles {
  std::string marker;                ///< file by which earlier results are known
  std::vector<std::string> files;    ///< the others, by name
  std::vector<std::string> folders;  ///< folders whose files with an `extension` are results
  std::vector<std::string> extensions;
};

/// Refuses a folder that is not empty, unless `force` is given and it has our marker.
/// What a killed run left half-written does not count. Throws IoError.
void check_output_folder(const std::filesystem::path& folder, const OutputFiles& ours, bool force);

/// Replaces the marker, and removes what a killed run left half-written. Throws IoError.
void mark_output_folder(const std::filesystem::path& folder, const OutputFiles& ours,
                        const std::string& marker_text);

/// Removes what a killed run left half-written of one file. Throws IoError.
void remove_leftovers_of(const std::filesystem::path& file);

/// Removes earlier results, and nothing else. `marker_text` replaces the marker first, so that a
/// folder never claims what it does not hold. Throws IoError.
void clear_output_folder(const std::filesystem::path& folder, const OutputFiles& ours,
                         const std::string& marker_text);

}  // namespace dynains::program
