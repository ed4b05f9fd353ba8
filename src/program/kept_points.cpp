#include "kept_points.hpp"

#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

#include "dynains/errors.hpp"
#include "dynains/io/kitti.hpp"
#include "labelled_sequence.hpp"

namespace dynains::program {
namespace {

/// Copies the static points of `scan` to `kept`. `file`: the labels, for messages.
void copy_static(const RecordedScan& scan, const std::vector<std::uint32_t>& labels,
                 const std::filesystem::path& file, PointBuffer& kept) {
  kept.grow(labels.size());
  std::size_t count = 0;
  bool is_finite = true;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const float* const p = scan.xyzi.data() + 4 * i;
    const bool is_static = run_class(labels[i], i, file) == kRunStatic;
    kept.x[count] = p[0];
    kept.y[count] = p[1];
    kept.z[count] = p[2];
    count += is_static ? 1 : 0;
    is_finite = is_finite && (!is_static || std::isfinite(p[0] + p[1] + p[2]));
  }
  if (!is_finite) {
    throw IoError(file.string() +
                  ": has static points whose coordinates are not finite; expected labels of a run "
                  "over these scans");
  }
  kept.resize(count);
}

}  // namespace

KeptPoints::KeptPoints(const Recording& recording, std::filesystem::path labels,
                       std::vector<std::size_t> scans)
    : recording_(recording), labels_(std::move(labels)), scans_(std::move(scans)) {
  constexpr std::size_t kAhead = 3;
  for (std::size_t i = 0; i < kAhead; ++i) launch({});
}

const PointBuffer& KeptPoints::next() {
  Slot spare = std::move(current_);
  current_ = pending_.front().get();
  pending_.pop_front();
  launch(std::move(spare));
  return current_.kept;
}

void KeptPoints::launch(Slot slot) {
  if (launched_ == scans_.size()) return;
  const std::size_t i = scans_[launched_++];
  pending_.push_back(std::async(std::launch::async, [this, i, reused = std::move(slot)]() mutable {
    read(i, reused);
    return std::move(reused);
  }));
}

void KeptPoints::read(std::size_t i, Slot& slot) const {
  recording_.read_scan(i, slot.scan);
  const std::filesystem::path file = labels_ / (recording_.name(i) + ".label");
  copy_static(slot.scan, read_labels(file, slot.scan.size()), file, slot.kept);
}

}  // namespace dynains::program
