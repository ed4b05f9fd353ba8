// Milliseconds of each scan and stage, and errors of the poses.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dynains/verdict.hpp"

namespace dynains::run {

inline double ms_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

struct TimingRow {
  std::string scan;
  std::size_t points = 0;
  StageTimes stages;
  double total = 0.0;  ///< ms in the pipeline, reading and writing of files apart
  std::optional<EpochReason> began_epoch = std::nullopt;
  Plausibility plausibility = {};
  double time = 0.0;                                            ///< s, of the scan
  std::optional<std::pair<double, double>> pose_residual = {};  ///< m and deg
};

struct RunTiming {
  std::vector<TimingRow> rows;
  std::array<std::uint64_t, 256> sensor_points{};  ///< by sensor, of several
  double flush = 0.0;     ///< ms for the verdicts that were open after the last scan
  double pipeline = 0.0;  ///< ms in the pipeline, all of the above included
};

}  // namespace dynains::run
