// The page that shows the results of a run, written into their folder.
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

/// The complete results of a run in `folder`, which is locked. Throws IoError.
OutputFolder open_finished_run(const std::filesystem::path& folder);

/// Writes view.html into a folder with complete results of a run over `recording`, and lists it in
/// report.json. Returns its path. Throws IoError.
std::filesystem::path write_view(OutputFolder& out, const Recording& recording,
                                 std::size_t max_points);

/// Opens the recording of a run by its report, which is in `report_file`.
using OpenRecording = std::function<Recording(const std::filesystem::path& report_file,
                                              const nlohmann::ordered_json& report)>;

/// Writes the page into the `folder` of a run. Throws IoError if it has no complete results,
/// and UsageError if another run writes to it.
std::filesystem::path write_view(const std::filesystem::path& folder, const OpenRecording& open,
                                 std::size_t max_points);

}  // namespace dynains::program
