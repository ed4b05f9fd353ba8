// Milliseconds of each scan and stage, and errors of the poses.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "dynains/verdict.hpp"

namespace dynains::program {

struct TimingRow {
  std::string scan;
  std::size_t points = 0;
  std::vector<double> stages;  ///< ms, in the order of RunTiming::stages
  double total = 0.0;          ///< ms in the pipeline, reading and writing of files apart
  std::optional<PoseResidual> pose_residual;
};

struct RunTiming {
  std::vector<std::string> stages;
  std::vector<TimingRow> rows;
  double reserve = 0.0;  ///< ms before the first scan, for its memory
  double flush = 0.0;    ///< ms for the verdicts that were open after the last scan
};

}  // namespace dynains::program
