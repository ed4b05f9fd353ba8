// Real recordings, which are not part of the project.
#pragma once

#include <filesystem>
#include <iostream>
#include <optional>
#include <string>

namespace dynains::test {

/// Folder of a recording in DYNAINS_SHARED_DATA. Where it is missing, says so in the words by which
/// ctest knows that a test was skipped: then nothing may have been checked, nor be checked later.
inline std::optional<std::filesystem::path> recording_or_skip(const std::string& name) {
  const std::filesystem::path folder = std::filesystem::path(DYNAINS_SHARED_DATA) / name;
  if (std::filesystem::is_directory(folder)) return folder;
  std::cout << "SKIPPED: no recording at " << folder << std::endl;
  return std::nullopt;
}

}  // namespace dynains::test
