// Folders that results go to: old and new files never mix.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace dynains::program {

/// Creates a folder and those above it. Throws IoError.
void create_folder(const std::filesystem::path& folder);

/// What a command writes into its folder.
struct OutputFiles {
  std::string marker;                ///< file by which earlier results are known
  std::vector<std::string> files;    ///< the others, by name
  std::vector<std::string> folders;  ///< folders whose files with an `extension` are results
  std::vector<std::string> extensions;
};

/// Makes `folder` ready for fresh results. A folder that is not empty is refused, unless `force` is
/// given and it has our marker: then the earlier results are removed, and nothing else.
/// `marker_text` replaces the marker first, so that a folder never claims what it does not hold.
/// Throws IoError.
void prepare_output_folder(const std::filesystem::path& folder, const OutputFiles& ours, bool force,
                           const std::string& marker_text);

}  // namespace dynains::program
