// Real recordings, which are not in the repository.
#pragma once

#include "support/standard.hpp"

namespace dynains::test {

/// Folder of a recording in DYNAINS_SHARED_DATA. If the recording is missing, prints the text by
/// which CTest counts the test as skipped; the caller must then return without checks. Throws if
/// the folder of recordings exists, or is required (DYNAINS_REQUIRE_SHARED_DATA), and lacks the
/// recording.
inline std::optional<std::filesystem::path> recording_or_skip(const std::string& name) {
  const std::filesystem::path folder = std::filesystem::path(DYNAINS_SHARED_DATA) / name;
  if (std::filesystem::is_directory(folder)) return folder;
  if (DYNAINS_REQUIRE_SHARED_DATA || std::filesystem::exists(DYNAINS_SHARED_DATA)) {
    throw std::runtime_error("expected a recording at " + folder.string());
  }
  std::cout << "SKIPPED: no recording at " << folder << std::endl;
  return std::nullopt;
}

}  // namespace dynains::test
