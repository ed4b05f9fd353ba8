// A session of a map of many sessions under corrected poses.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "dynains/city/session_writer.hpp"
#include "dynains/io/recording.hpp"

namespace dynains::program {

/// The run and the poses from which a session is written again.
struct ReposedSession {
  std::filesystem::path city;
  std::string name;
  std::filesystem::path run;       ///< folder of the finished run, for its verdicts
  std::string fingerprint;         ///< of the corrected poses
  std::vector<std::size_t> scans;  ///< of the run, indices in the recordings
};

/// Writes a session of the verdicts of a run at the poses of `corrected`, whose data waits in
/// `store`; commit() of the result puts it in the place of the earlier one. Begin, recording and
/// configuration stay; an alignment ends: the poses are those of the map. Until the commit, and
/// after any error or signal, the map is as it was. `points`: the recording as the run read it.
/// Throws ConfigError, IoError, UsageError, Interrupted.
std::unique_ptr<SessionWriter> repose_session(const ReposedSession& request,
                                              const Recording& points, const Recording& corrected,
                                              ByteStore& store);

}  // namespace dynains::program
