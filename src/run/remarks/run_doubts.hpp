// Suspicious scans and poses of a run.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"
#include "pose_returns.hpp"
#include "run/run_timing.hpp"
#include "run/scan_range.hpp"

namespace dynains::run {

/// Doubts about the poses and clouds of a run.
struct RunDoubts {
  std::vector<std::string> sentences;  ///< one for each doubt
  nlohmann::ordered_json json;         ///< "jumps", "suspicious" and "returns" of a report
};

/// `timing`: of the scans of `range` that were pushed. Throws IoError.
RunDoubts find_doubts(const Recording& recording, const ScanRange& range, const RunTiming& timing,
                      const std::vector<ReturnError>& returns = {});

}  // namespace dynains::run
