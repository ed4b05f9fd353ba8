// Whole text files of bounded size.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace dynains::program {

/// Bytes that a text file may have.
inline constexpr std::uint64_t kMaxTextBytes = std::uint64_t{64} << 20U;

/// The bytes of a regular file. Throws IoError, also for a folder, a device or a larger file.
std::string read_text_file(const std::filesystem::path& path);

}  // namespace dynains::program
