// Everything about a run that is known before anything is written.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "dynains/io/recording.hpp"
#include "run/output/input_files.hpp"
#include "run/output/output_folder.hpp"
#include "run_settings.hpp"
#include "scan_range.hpp"
#include "session_request.hpp"

namespace dynains::run {

struct RunPlan {
  RunSettings settings;  ///< complete
  Recording sequence;
  ScanRange range;
  OutputListing listing;  ///< of the results
  InputFiles inputs;
  nlohmann::ordered_json configuration;  ///< parameter name -> value
  nlohmann::ordered_json request;        ///< what determines the results and is in no other field
  SessionRequest session;
};

/// Path of the file that a flag --map names, links followed. `out`: folder of the results, by
/// whole_path(). Throws ConfigError unless the name ends in .ply, .pcd or .las and no other result
/// goes there.
std::filesystem::path map_path(const std::string& name, const std::filesystem::path& out);

/// Fingerprint of the names, poses and times of the scans; their points are not read.
std::string pose_fingerprint(const Recording& recording, const ScanRange& range);

/// Checks what can be checked without the recording. Throws ConfigError, and
/// std::filesystem::filesystem_error for a path of `out` that cannot be.
void check_settings(const RunSettings& settings);

/// Checks everything but the points. Throws ConfigError, IoError, PoseError.
RunPlan make_plan(const RunSettings& given, Recording sequence);

/// The scans in a window. Throws ConfigError if there is none.
ScanRange select_scans(const Recording& sequence, const ScanWindow& window);

}  // namespace dynains::run
