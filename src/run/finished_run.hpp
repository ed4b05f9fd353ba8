// Checks that the results of a run are complete.
#pragma once

#include <filesystem>

namespace dynains::program {

/// Throws IoError if report.json in `folder` is a report of `dynains run` that is not complete, or
/// cannot be read as JSON. Folders of other tools, and folders without report.json, pass.
void check_run_is_finished(const std::filesystem::path& folder);

}  // namespace dynains::program
