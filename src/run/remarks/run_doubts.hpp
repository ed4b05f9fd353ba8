// Suspicious scans and poses of a run, and places that a trajectory comes back to.
#pragma once

#include <cstddef>
#include <filesystem>
#include <iosfwd>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/recording/returns.hpp"
#include "run/run_timing.hpp"
#include "run/scan_range.hpp"

namespace dynains::run {

/// Scans near each other that come back to scans near each other. Numbers are those of the
/// recording.
struct ReturnError {
  std::size_t first_earlier, last_earlier;
  std::size_t first_later, last_later;
  double metres, degrees;  ///< where the translation is off by the most
};

/// Finds the returns of a whole recording, from all points of its scans. Points wait in a file
/// without a name in `folder`. Throws IoError.
std::vector<ReturnToPlace> find_returns(const Recording& recording,
                                        const std::filesystem::path& folder);

/// Errors of at least 0.3 m of the poses of a recording. `first`: the scan of the recording that
/// `returns` call 0.
std::vector<ReturnError> return_errors(const Recording& recording, std::size_t first,
                                       const std::vector<ReturnToPlace>& returns);

/// "the trajectory returns to scans 000020 to 000090 in scans ...".
std::string sentence(const ReturnError& error, const Recording& recording);

/// Writes the certain returns as edges of a pose graph, EDGE_SE3:QUAT of g2o. Vertices are numbers
/// of scans.
void write_closures(std::ostream& text, const std::vector<ReturnToPlace>& returns);

/// Doubts about the poses and clouds of a run.
struct RunDoubts {
  std::vector<std::string> sentences;  ///< one for each doubt
  nlohmann::ordered_json json;         ///< "jumps", "suspicious" and "returns" of a report
};

/// `timing`: of the scans of `range` that were pushed. Throws IoError.
RunDoubts find_doubts(const Recording& recording, const ScanRange& range, const RunTiming& timing,
                      const std::vector<ReturnError>& returns = {});

}  // namespace dynains::run
