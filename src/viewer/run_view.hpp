// Content of the page from a recording and the files of a run over it.
#pragma once

#include <cstddef>
#include <filesystem>

#include "dynains/io/recording.hpp"
#include "sightings.hpp"
#include "view_data.hpp"

namespace dynains::viewer {

struct RunFiles {
  std::filesystem::path folder;         ///< with labels; optional: causes, beliefs
  std::filesystem::path map;            ///< empty: none
  std::size_t first = 0;                ///< index of the first scan in the recording
  std::size_t last = 0;                 ///< index of the last scan, inclusive
  ReferenceWindow references{0, 0, 1};  ///< scans that are compared with removed points
};

/// Reads scan by scan, reference scans twice. The page gets at most `max_points` points: the map
/// first, then moving points. Throws IoError, and ConfigError for more than 65535 scans.
ViewData view_of_run(const Recording& recording, const RunFiles& files, std::size_t max_points);

}  // namespace dynains::viewer
