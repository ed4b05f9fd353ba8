#include "open_scans.hpp"

#include <utility>

namespace dynains::program {
namespace {

constexpr std::size_t kFewScans = 8;

}  // namespace

OpenScans::OpenScans(const Recording& recording, const ScanRange& pushed, std::size_t latency,
                     std::launch thread)
    : are_kept_(latency <= kFewScans || recording.format() != ScanFormat::kBin),
      reader_(recording, pushed.first, pushed.last, thread) {}

const RecordedScan& OpenScans::next() {
  if (!are_kept_) return pushed_scan_ = reader_.next(std::move(pushed_scan_));
  kept_.push_back(reader_.next(std::move(judged_scan_)));
  judged_scan_ = {};
  return kept_.back();
}

RecordedScan* OpenScans::next_judged() {
  if (!are_kept_) return nullptr;
  judged_scan_ = std::move(kept_.front());
  kept_.pop_front();
  return &judged_scan_;
}

}  // namespace dynains::program
