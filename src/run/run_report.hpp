// report.json, timing.csv and tracks.csv.
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "dynains/verdict.hpp"
#include "run_plan.hpp"
#include "run_timing.hpp"

namespace dynains::run {

class RunResults;

/// A moving object in a scan.
struct TrackRow {
  std::size_t scan = 0;
  double time = 0.0;  ///< s
  MovingObject object;
};

/// "median", "p95", "p99" and "max" of one number, for example milliseconds, over all scans.
/// Quantiles are the smallest value that at least that share of the values does not exceed; all 0
/// if there are none.
nlohmann::ordered_json statistics(std::vector<double> values);

/// `doubts`: see to_json(RunDoubts), and "warnings".
nlohmann::ordered_json make_report(const RunPlan& plan, const nlohmann::ordered_json& doubts,
                                   const RunResults& results, const RunTiming& timing);

/// Throws IoError.
void write_timing(const std::filesystem::path& path, const RunTiming& timing);
/// Writes a row for each object of each scan, by scan and id. Throws IoError.
void write_tracks(const std::filesystem::path& path, std::vector<TrackRow>& rows);

}  // namespace dynains::run
