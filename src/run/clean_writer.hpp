// Scans without dynamic points.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "dynains/io/recording.hpp"
#include "verdict_files.hpp"

namespace dynains::run {

/// File name of the clean scan i of a recording.
std::string clean_name(const Recording& recording, std::size_t i);

/// Writes a scan to `folder`: all finite points that are not dynamic, or with `drop_not_judged` all
/// static ones, in their order and frame. Files of .bin, .pcd and .ply are copied without the other
/// points, so that all columns stay as they are. Scans of other formats become .pcd with the
/// columns of the scan, m. Throws IoError.
void write_clean(const Recording& recording, const JudgedScan& judged,
                 const std::filesystem::path& folder, bool drop_not_judged);

}  // namespace dynains::run
