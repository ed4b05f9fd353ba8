#include "read_ahead.hpp"

#include <utility>

namespace dynains::program {

ReadAhead::ReadAhead(const KittiSequence& sequence, std::size_t first, std::size_t last)
    : sequence_(sequence), next_(first), last_(last) {
  launch({});
}

std::vector<float> ReadAhead::next(std::vector<float> recycled) {
  std::vector<float> scan = pending_.get();
  launch(std::move(recycled));
  return scan;
}

void ReadAhead::launch(std::vector<float> buffer) {
  if (next_ > last_) return;
  pending_ = std::async(std::launch::async,
                        [&sequence = sequence_, i = next_++, scan = std::move(buffer)]() mutable {
                          sequence.read_scan(i, scan);
                          return std::move(scan);
                        });
}

}  // namespace dynains::program
