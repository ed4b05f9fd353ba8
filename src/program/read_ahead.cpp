#include "read_ahead.hpp"

#include <utility>

namespace dynains::program {

ReadAhead::ReadAhead(const Recording& recording, std::size_t first, std::size_t last,
                     std::launch thread)
    : recording_(recording), next_(first), last_(last), thread_(thread) {
  launch({});
}

RecordedScan ReadAhead::next(RecordedScan recycled) {
  RecordedScan scan = pending_.get();
  launch(std::move(recycled));
  return scan;
}

void ReadAhead::launch(RecordedScan buffer) {
  if (next_ > last_) return;
  pending_ = std::async(thread_,
                        [&recording = recording_, i = next_++, scan = std::move(buffer)]() mutable {
                          recording.read_scan(i, scan);
                          return std::move(scan);
                        });
}

}  // namespace dynains::program
