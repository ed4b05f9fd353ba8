// Files that are read: only regular ones, and errors with the reason of the system.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <vector>

namespace dynains {

/// Whether anything, a folder or a regular file is there; links are followed. Throw IoError if the
/// system cannot answer.
bool is_there(const std::filesystem::path& path);
bool is_folder(const std::filesystem::path& path);
bool is_file(const std::filesystem::path& path);

/// Bytes of a file. Throws IoError.
std::uint64_t size_of_file(const std::filesystem::path& path);

/// All that lies directly in a folder, in no order. Throws IoError.
std::vector<std::filesystem::path> paths_in(const std::filesystem::path& folder);

/// Opens a regular file to read. Throws IoError, also for folders, and for devices and pipes, whose
/// reading may never end.
std::ifstream open_input(const std::filesystem::path& path);

}  // namespace dynains
