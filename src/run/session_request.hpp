// Request of a run to add a session to a map of many sessions.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "dynains/city/session.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/pose.hpp"
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

}  // namespace dynains::run
