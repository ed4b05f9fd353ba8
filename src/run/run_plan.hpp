// Everything about a run that is known before anything is written.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "dynains/city/session.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/pose.hpp"
#include "run/output/output_folder.hpp"
#include "run_settings.hpp"
#include "scan_range.hpp"

namespace dynains::run {

/// Which session goes into which map of many sessions.
struct SessionRequest {
  std::filesystem::path city;  ///< by whole_path(); empty: none
  SessionInfo info;            ///< without counts
  SessionGrid grid;
  std::optional<Pose> T_city_start;  ///< of the alignment; empty: none is asked for

  /// Whether the city has this session already, from the same scans, poses, times and
  /// configuration. Throws IoError.
  bool is_fulfilled() const;
};

/// A session of the map in `folder`, to be written again under poses of this fingerprint: begin,
/// recording and configuration stay, an alignment ends. Throws ConfigError if there is none of this
/// name, IoError.
SessionRequest reposed_session(const std::filesystem::path& folder, const std::string& name,
                               const std::string& fingerprint);

/// The request with the alignment that it asks for. Nothing changes in the map. Throws ConfigError
/// if the scans do not fit, IoError.
SessionRequest aligned(SessionRequest request, const Recording& recording, const ScanRange& range);

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
