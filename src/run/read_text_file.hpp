// Whole text files of bounded size.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace dynains::program {

/// The bytes of a regular file of at most `max_bytes`. `expected` ends the messages: "a config
/// file". Throws IoError with path and expectation: for a folder, a device or a larger file, too.
std::string read_text_file(const std::filesystem::path& path, std::uint64_t max_bytes,
                           const std::string& expected);

}  // namespace dynains::program
