// Finished results of a run, and the page that shows them, written into their folder.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>

#include "dynains/io/recording.hpp"
#include "output_folder.hpp"

namespace dynains::program {

/// Points on a page: for 1 million, it has some 10 MB.
inline constexpr std::size_t kDefaultViewPoints = 1000000;

/// Throws IoError if report.json in `folder` is a report of `dynains run` that is not complete, or
/// cannot be read as JSON. Folders of other tools, and folders without report.json, pass.
void check_run_is_finished(const std::filesystem::path& folder);

/// The complete results of a run. Throws IoError, and UsageError if another command uses the
/// folder.
ResultFolder open_finished_run(const std::filesystem::path& folder);

/// Writes the file `page` about results in `folder`, with this report, of a run over `recording`.
/// Throws IoError.
void write_page(const std::filesystem::path& page, const std::filesystem::path& folder,
                const nlohmann::ordered_json& report, const Recording& recording,
                std::size_t max_points);

/// Opens the recording of a run by its report, which is in `report_file`.
using OpenRecording = std::function<Recording(const std::filesystem::path& report_file,
                                              const nlohmann::ordered_json& report)>;

/// Adds view.html to complete results of a run in `folder`. Returns its path. Throws IoError, and
/// UsageError if another command uses the folder.
std::filesystem::path add_page(const std::filesystem::path& folder, const OpenRecording& open,
                               std::size_t max_points);

}  // namespace dynains::program
