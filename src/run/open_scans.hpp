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
  /// `pushed`: the scans to push, of a recording that outlives this. `judged`: those of them that
  /// are needed for their final verdict. `latency`: pushes after a scan before its final verdict.
  /// `thread`: as of ReadAhead.
  OpenScans(const Recording& recording, const ScanRange& pushed, const ScanRange& judged,
            std::size_t latency, std::launch thread);

  /// To be called once for each scan of `pushed`. The scan is valid until the next call of a
  /// member. Throws IoError if it could not be read.
  const RecordedScan& next();
  /// To be called once for each scan of `judged`, behind its next(). Null if scans are not kept,
  /// but to be read a second time; else as next(). The caller may exchange the scan for another
  /// one, whose memory is used again.
  RecordedScan* next_judged();

 private:
  bool is_judged(std::size_t i) const { return i >= judged_.first && i <= judged_.last; }

  ScanRange judged_;
  std::size_t next_;
  bool are_kept_;
  ReadAhead reader_;
  std::deque<RecordedScan> kept_;  // oldest first; the last one is the pushed scan
  RecordedScan pushed_scan_;       // unless it is kept
  RecordedScan judged_scan_;
};

}  // namespace dynains::program
