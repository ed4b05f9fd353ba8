// The next scan is read while the pipeline works on this one, if there is a thread for it.
#pragma once

#include <cstddef>
#include <future>
#include <utility>

#include "dynains/io/recording.hpp"
#include "dynains/threads/background.hpp"

namespace dynains::run {

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
    if (next_ <= last_) reading_.begin([this, i = next_++] { recording_.read_scan(i, scan_); });
  }

  const Recording& recording_;
  std::size_t next_;
  std::size_t last_;
  RecordedScan scan_;  // belongs to the reading thread until reading_.wait()
  Background reading_;
};

}  // namespace dynains::run
