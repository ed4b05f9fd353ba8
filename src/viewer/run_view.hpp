// Content of the page from a recording and the files of a run over it.
#pragma once

#include <cstddef>
#include <filesystem>

#include "dynains/io/recording.hpp"
#include "view_data.hpp"

namespace dynains::viewer {

struct RunFiles {
  std::filesystem::path folder;  ///< with labels; optional: causes, beliefs
  std::size_t first = 0;         ///< index of the first scan in the recording
  std::size_t last = 0;          ///< index of the last scan, inclusive
  double map_voxel = 0.0;        ///< m
};

/// Reads scan by scan. The page gets at most `max_points` points: the first static point of each
/// voxel, up to two thirds, and moving points. Throws IoError, and ConfigError for more than 65535
/// scans.
ViewData view_of_run(const Recording& recording, const RunFiles& files, std::size_t max_points);

}  // namespace dynains::viewer
