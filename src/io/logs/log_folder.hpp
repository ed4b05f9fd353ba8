// Logs that consist of several files in a folder.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace dynains {

/// Extension of a log by its name: ".mcap", ".bag" (also for NAME.bag.active) or ".db3"; also if
/// the file is compressed as a whole, as NAME.mcap.zstd. Else empty.
std::string log_extension(const std::filesystem::path& path);

/// Whether the file is compressed as a whole, by its name.
bool is_compressed_log(const std::filesystem::path& path);

/// Files with a name of a log directly in a folder, by name. A compressed file beside its
/// decompressed form is left out. Throws IoError.
std::vector<std::filesystem::path> logs_in_folder(const std::filesystem::path& folder);

struct LogParts {
  std::vector<std::filesystem::path> files;
  std::optional<std::filesystem::path> metadata;
  std::optional<std::string> missing;  ///< which parts are not there, one sentence
};

/// The parts of the log in a folder, by metadata.yaml; without that file the only log, or parts
/// NAME_0, NAME_1, ... Throws IoError if the files may be several logs.
LogParts find_parts(const std::filesystem::path& folder);

}  // namespace dynains
