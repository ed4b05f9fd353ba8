// The scans of a run: read ahead for their push, and kept for their final verdict.
#pragma once

#include <cstddef>
#include <deque>
#include <future>

#include "dynains/io/recording.hpp"
#include "read_ahead.hpp"
#include "scan_range.hpp"

namespace dynains::program {

/// Scans without a final verdict are kept in memory, unless they are many and a second reading is a
/// plain copy of their file (.bin).
class OpenScans {
 public:
  /// `pushed`: the scans to push, of a recording that outlives this. `latency`: pushes after a scan
  /// before its final verdict. `thread`: as of ReadAhead.
  OpenScans(const Recording& recording, const ScanRange& pushed, std::size_t latency,
            std::launch thread);

  /// To be called once for each scan of `pushed`. The scan is valid until the next call of a
  /// member. Throws IoError if it could not be read.
  const RecordedScan& next();
  /// To be called once for each scan of `pushed`, behind its next(). Null if scans are not kept,
  /// but to be read a second time; else as next(). The caller may exchange the scan for another
  /// one, whose memory is used again.
  RecordedScan* next_judged();

 private:
  bool are_kept_;
  ReadAhead reader_;
  std::deque<RecordedScan> kept_;  // oldest first; the last one is the pushed scan
  RecordedScan pushed_scan_;       // unless it is kept
  RecordedScan judged_scan_;
};

}  // namespace dynains::program
