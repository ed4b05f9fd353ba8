// Copies of point files without some of their points.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <ostream>
#include <string>

#include "dynains/points.hpp"

namespace dynains {

class ByteReader;

/// Writes the PLY, PCD or raw file (.bin) `path` to `target` without some of its points. All
/// columns and comments stay as they are; compressed points of PCD become binary ones. `keep`: for
/// each point of read_points(), 0 if it is left out. Throws IoError, also for a PLY file that has
/// more than points, such as faces.
void copy_points(const std::filesystem::path& path, Span<const std::uint8_t> keep,
                 std::ostream& target);

/// Writes the first `size` bytes of `path`, lines of text, with `edit` applied to each of them.
void copy_lines(const std::filesystem::path& path, std::uint64_t size, std::ostream& target,
                const std::function<std::string(const std::string&)>& edit);

/// Copies the records that `keep` names from where `reader` is: lines if `size` is 0, else `size`
/// bytes each. `record`: the name of one in errors, for example "a point".
void copy_records(ByteReader& reader, std::size_t size, const char* record,
                  Span<const std::uint8_t> keep, std::ostream& target);
/// Number of records that `keep` names.
std::size_t kept_count(Span<const std::uint8_t> keep);

void copy_ply(const std::filesystem::path& path, Span<const std::uint8_t> keep,
              std::ostream& target);
void copy_pcd(const std::filesystem::path& path, Span<const std::uint8_t> keep,
              std::ostream& target);

}  // namespace dynains
