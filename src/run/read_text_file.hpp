// Whole text files of bounded size.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace dynains::program {

/// The bytes of a regular file of at most `max_bytes`. Throws IoError, also for a folder, a device
/// or a larger file.
std::string read_text_file(const std::filesystem::path& path, std::uint64_t max_bytes);

}  // namespace dynains::program
