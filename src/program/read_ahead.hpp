// The next scan is read while the pipeline works on this one.
#pragma once

#include <cstddef>
#include <future>

#include "dynains/io/recording.hpp"

namespace dynains::program {

class ReadAhead {
 public:
  /// Scans `first` to `last`, both inclusive, of a recording that outlives this.
  ReadAhead(const Recording& recording, std::size_t first, std::size_t last);

  /// To be called once for each scan. The next one; throws IoError if it could not be read.
  /// `recycled` gives its memory to the scan after it.
  RecordedScan next(RecordedScan recycled);

 private:
  void launch(RecordedScan buffer);

  const Recording& recording_;
  std::size_t next_;
  std::size_t last_;
  std::future<RecordedScan> pending_;
};

}  // namespace dynains::program
