// Suspicious scans and poses of a run.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/plausibility.hpp"
#include "pose_returns.hpp"
#include "run/run_timing.hpp"
#include "run/scan_range.hpp"

namespace dynains::run {

/// Scans in a row that no correct recording gives.
struct SuspiciousScans {
  Suspicion suspicion = Suspicion::kNone;
  std::size_t first = 0;  ///< scan of the recording
  std::size_t count = 0;
  Plausibility worst;  ///< of the window with the largest shares
};

/// A scan that begins an epoch because its surfaces do not fit, and how far its motion lies from
/// those beside it.
struct PoseJump {
  std::size_t scan = 0;
  double translation = 0.0;  ///< m
  double rotation = 0.0;     ///< deg
};

struct RunDoubts {
  std::vector<PoseJump> jumps;
  std::vector<SuspiciousScans> parts;  ///< at most one for each kind: the first one
  std::vector<ReturnError> returns;
};

/// `timing`: of the scans of `range` that were pushed. Throws IoError.
RunDoubts find_doubts(const Recording& recording, const ScanRange& range, const RunTiming& timing);

/// One sentence for each doubt.
std::vector<std::string> sentences(const RunDoubts& doubts, const Recording& recording);

/// "jumps", "suspicious" and "returns" of a report.
nlohmann::ordered_json to_json(const RunDoubts& doubts, const Recording& recording);

}  // namespace dynains::run
