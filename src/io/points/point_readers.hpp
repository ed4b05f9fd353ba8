// One reader for each format of point files.
#pragma once

#include <cstddef>
#include <filesystem>

#include "dynains/io/point_file.hpp"

namespace dynains {

class PointSink;

/// Lines, fields or columns that a header may have.
inline constexpr std::size_t kMostHeaderItems = 1000;

void read_ply(const std::filesystem::path& path, PointSink& sink);
void read_pcd(const std::filesystem::path& path, PointSink& sink);
void read_las(const std::filesystem::path& path, PointSink& sink);
void read_npy(const std::filesystem::path& path, PointSink& sink);
void read_xyz(const std::filesystem::path& path, PointSink& sink);

/// Throw IoError unless the file can hold the points of its header, too.
PointFileHeader read_ply_header(const std::filesystem::path& path);
PointFileHeader read_pcd_header(const std::filesystem::path& path);
PointFileHeader read_las_header(const std::filesystem::path& path);
PointFileHeader read_npy_header(const std::filesystem::path& path);
PointFileHeader read_xyz_header(const std::filesystem::path& path);

}  // namespace dynains
