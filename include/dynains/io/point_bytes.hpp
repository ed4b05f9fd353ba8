// Files with one byte per point of a scan.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "dynains/points.hpp"

namespace dynains {

/// Reads a file with one byte per point. Empty if there is no such file. Throws IoError unless the
/// file has `count` bytes.
std::vector<std::uint8_t> read_point_bytes(const std::filesystem::path& file, std::size_t count);

/// Replaces the file atomically, without synchronization with the disk. Throws IoError.
void write_point_bytes(const std::filesystem::path& file, Span<const std::uint8_t> bytes);

}  // namespace dynains
