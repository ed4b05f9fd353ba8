// Milliseconds of each scan and stage, and errors of the poses.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dynains/verdict.hpp"

namespace dynains::program {

struct TimingRow {
  std::string scan;
  std::size_t points = 0;
  std::vector<double> stages;  ///< ms, in the order of RunTiming::stages
  double total = 0.0;          ///< ms in the pipeline, reading and writing of files apart
  std::optional<PoseResidual> pose_residual;
  std::optional<EpochReason> began_epoch = std::nullopt;
  Plausibility plausibility = {};
  double time = 0.0;  ///< s, of the scan
};

struct RunTiming {
  std::vector<std::string> stages;
  std::vector<TimingRow> rows;
  double flush = 0.0;     ///< ms for the verdicts that were open after the last scan
  double pipeline = 0.0;  ///< ms in the pipeline, all of the above included
};

/// Names of the stages, RunTiming::stages.
inline std::vector<std::string> stage_names() {
  std::vector<std::string> names;
  const StageTimes no_times;
  StageTimes::visit(no_times, [&](const char* name, double) { names.emplace_back(name); });
  return names;
}

/// The row of a push that took `total` ms.
inline TimingRow timing_row(std::string scan, std::size_t points, double total,
                            const FrameResult& frame) {
  TimingRow row{std::move(scan),   points, {}, total, frame.pose_residual, frame.began_epoch,
                frame.plausibility};
  StageTimes::visit(frame.times, [&](const char*, double ms) { row.stages.push_back(ms); });
  return row;
}

}  // namespace dynains::program
