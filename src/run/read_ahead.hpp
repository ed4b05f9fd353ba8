// Scans that are read before they are needed, and kept as long as they are.
#pragma once

#include <cstddef>
#include <deque>
#include <future>
#include <utility>

#include "dynains/io/recording.hpp"
#include "dynains/threads/background.hpp"
#include "scan_range.hpp"

namespace dynains::program {

/// The next scan is read while the pipeline works on this one, if there is a thread for it.
class ReadAhead {
 public:
  /// Scans `first` to `last`, both inclusive, of a recording that outlives this. `thread`: async to
  /// read in another thread, deferred to read in next().
  ReadAhead(const Recording& recording, std::size_t first, std::size_t last, std::launch thread)
      : recording_(recording), next_(first), last_(last), reading_(thread) {
    launch();
  }

  /// To be called once for each scan. The next one; throws IoError if it could not be read.
  /// `recycled` gives its memory to the scan after it.
  RecordedScan next(RecordedScan recycled) {
    reading_.wait();
    std::swap(scan_, recycled);
    launch();
    return recycled;
  }

 private:
  void launch() {
    if (next_ > last_) return;
    reading_.begin([this, i = next_++] { recording_.read_scan(i, scan_); });
  }

  const Recording& recording_;
  std::size_t next_;
  std::size_t last_;
  RecordedScan scan_;  // belongs to the reading thread until reading_.wait()
  Background reading_;
};

/// The scans of a run: read ahead for their push, and kept for their final verdict, unless they are
/// many and a second reading is a plain copy of their file (.bin).
class OpenScans {
 public:
  /// `pushed`: the scans to push, of a recording that outlives this. `latency`: pushes after a scan
  /// before its final verdict. `thread`: as of ReadAhead.
  OpenScans(const Recording& recording, const ScanRange& pushed, std::size_t latency,
            std::launch thread)
      : are_kept_(latency <= kFewScans || recording.format() != ScanFormat::kBin),
        reader_(recording, pushed.first, pushed.last, thread) {}

  /// To be called once for each scan of `pushed`. The scan is valid until the next call of a
  /// member. Throws IoError if it could not be read.
  const RecordedScan& next() {
    if (!are_kept_) return pushed_scan_ = reader_.next(std::move(pushed_scan_));
    kept_.push_back(reader_.next(std::move(judged_scan_)));
    judged_scan_ = {};
    return kept_.back();
  }
  /// To be called once for each scan of `pushed`, behind its next(). Null if scans are not kept,
  /// but to be read a second time; else as next(). The caller may exchange the scan for another
  /// one, whose memory is used again.
  RecordedScan* next_judged() {
    if (!are_kept_) return nullptr;
    judged_scan_ = std::move(kept_.front());
    kept_.pop_front();
    return &judged_scan_;
  }

 private:
  static constexpr std::size_t kFewScans = 8;

  bool are_kept_;
  ReadAhead reader_;
  std::deque<RecordedScan> kept_;  // oldest first; the last one is the pushed scan
  RecordedScan pushed_scan_;       // unless it is kept
  RecordedScan judged_scan_;
};

}  // namespace dynains::program
