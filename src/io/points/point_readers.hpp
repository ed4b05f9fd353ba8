// One reader for each format of point files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

namespace dynains {

class PointSink;

/// Lines, fields or columns that a header may have.
inline constexpr std::size_t kMaxHeaderItems = 1000;

/// Read the columns, and the points as well if `with_points`. Return the number of points. Throw
/// IoError unless the file can hold those of its header.
std::uint64_t read_ply(const std::filesystem::path& path, PointSink& sink, bool with_points);
std::uint64_t read_pcd(const std::filesystem::path& path, PointSink& sink, bool with_points);
std::uint64_t read_las(const std::filesystem::path& path, PointSink& sink, bool with_points);
std::uint64_t read_npy(const std::filesystem::path& path, PointSink& sink, bool with_points);
std::uint64_t read_xyz(const std::filesystem::path& path, PointSink& sink, bool with_points);

}  // namespace dynains
