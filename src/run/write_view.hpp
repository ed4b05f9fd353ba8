// Finished results of a run, and the page that shows them, written into their folder.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <vector>

#include "dynains/io/recording.hpp"
#include "run/output/output_folder.hpp"
#include "scan_range.hpp"
#include "verdict_files.hpp"
#include "viewer/page.hpp"

namespace dynains::run {

/// Points on a page: for 1 million, it has some 10 MB.
inline constexpr std::size_t kDefaultViewPoints = 1000000;

/// Throws IoError if report.json in `folder` is a report of `dynains run` that is not complete, or
/// cannot be read as JSON. Folders of other tools, and folders without report.json, pass.
void check_run_is_finished(const std::filesystem::path& folder);

/// The complete results of a run. Throws IoError, and UsageError if another command uses the
/// folder.
ResultFolder open_finished_run(const std::filesystem::path& folder);

/// The scans of a run. Throws IoError if its recording lacks one.
std::vector<std::size_t> scans_of_run(const ResultFolder& out, const Recording& recording);

/// An empty page of the scans of a run. `map_voxel`: m. Throws ConfigError if there are too many.
viewer::Page make_page(const Recording& recording, const ScanRange& range, double map_voxel,
                       std::size_t max_points = kDefaultViewPoints);
/// Adds a scan with `packed` and `truth`.
void add_to_page(const Recording& recording, const JudgedScan& judged, viewer::Page& page);
/// Throws IoError.
void write_page(viewer::Page& page, const std::filesystem::path& file);

/// Opens the recording of a run by its report.
using OpenRecording = std::function<Recording(const ResultFolder& out)>;

/// Adds view.html to complete results of a run in `folder`. Returns its path. Throws IoError, and
/// UsageError if another command uses the folder.
std::filesystem::path add_page(const std::filesystem::path& folder, const OpenRecording& open,
                               std::size_t max_points);

}  // namespace dynains::run
