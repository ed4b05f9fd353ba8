// Milliseconds of each scan and stage.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace dynains::program {

struct TimingRow {
  std::string scan;
  std::size_t points = 0;
  std::vector<double> stages;  ///< ms, in the order of RunTiming::stages
  double total = 0.0;          ///< ms in the pipeline, reading and writing of files apart
};

struct RunTiming {
  std::vector<std::string> stages;
  std::vector<TimingRow> rows;
  double reserve = 0.0;  ///< ms before the first scan, for its memory
  double flush = 0.0;    ///< ms for the verdicts that were open after the last scan
};

}  // namespace dynains::program
