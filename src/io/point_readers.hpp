// One reader for each format of point files.
#pragma once

#include <filesystem>

#include "dynains/io/point_file.hpp"

namespace dynains {

PointFile read_ply(const std::filesystem::path& path);
PointFile read_pcd(const std::filesystem::path& path);

PointFileHeader read_ply_header(const std::filesystem::path& path);
PointFileHeader read_pcd_header(const std::filesystem::path& path);

void check_ply(const std::filesystem::path& path);
void check_pcd(const std::filesystem::path& path);

}  // namespace dynains
