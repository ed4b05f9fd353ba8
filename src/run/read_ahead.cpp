#include "read_ahead.hpp"

#include <utility>

namespace dynains::run {

ReadAhead::ReadAhead(const Recording& recording, std::size_t first, std::size_t last,
                     std::launch thread)
    : recording_(recording), next_(first), last_(last), reading_(thread) {
  launch();
}

RecordedScan ReadAhead::next(RecordedScan recycled) {
  reading_.wait();
  std::swap(scan_, recycled);
  launch();
  return recycled;
}

void ReadAhead::launch() {
  if (next_ > last_) return;
  reading_.begin([this, i = next_++] { recording_.read_scan(i, scan_); });
}

}  // namespace dynains::run
