// One place of a recording: what its scans and the first pass tell of it.
#pragma once

#include <algorithm>
#include <cstdint>

#include "dynains/recording/cell_samples.hpp"

namespace dynains {

/// Scans from `first` to `last`.
struct ScanSpan {
  std::uint32_t first = 0, last = UINT32_MAX;
};

/// Scans in which something was seen in a place: 64 slices of time, which double when the recording
/// gets longer.
class Presence {
 public:
  void add(std::uint32_t scan) {
    for (; scan >> shift_ >= kSlices; ++shift_) fold();
    bits_ |= std::uint64_t{1} << (scan >> shift_);
  }
  /// Whether something was there in a slice that lies in the span as a whole.
  bool any_within(const ScanSpan& scans) const { return (bits_ & within(scans)) != 0; }

 private:
  static constexpr std::uint32_t kSlices = 64;

  // Bits of the slices that lie in the span.
  std::uint64_t within(const ScanSpan& scans) const {
    const std::uint64_t width = std::uint64_t{1} << shift_;
    const std::uint64_t first = (scans.first + width - 1) >> shift_;
    const std::uint64_t end =
        std::min<std::uint64_t>(kSlices, (scans.last + std::uint64_t{1}) >> shift_);
    if (first >= end) return 0;
    return (~std::uint64_t{0} >> (kSlices - (end - first))) << first;
  }
  // Two slices become one.
  void fold() {
    std::uint64_t half = 0;
    for (std::uint32_t i = 0; i < kSlices / 2; ++i) {
      half |= static_cast<std::uint64_t>((bits_ >> (2 * i) & 3U) != 0) << i;
    }
    bits_ = half;
  }

  std::uint64_t bits_ = 0;
  std::uint8_t shift_ = 0;
};

/// Verdicts of the first pass on the points of a place, by epochs: scans that are near each other
/// in time and in the place of the sensor.
struct FirstVerdicts {
  std::uint16_t first_epoch = 0, last_epoch = 0;  ///< that measured the place; 0: none
  bool removed_first = true;                      ///< the first epoch removed all points
  bool removed_last = false;                      ///< the last one did
  bool any_kept = false;
  std::uint32_t first_scan = 0, last_scan = 0;  ///< that measured the place

  /// Adds a point. Epochs, counted from 1, and scans ascend.
  void add(bool is_removed, std::uint16_t epoch, std::uint32_t scan) {
    if (first_epoch == 0) {
      first_epoch = epoch;
      first_scan = scan;
    }
    removed_last = is_removed && (removed_last || epoch != last_epoch);
    removed_first = removed_first && (is_removed || epoch != first_epoch);
    any_kept = any_kept || !is_removed;
    last_epoch = epoch;
    last_scan = scan;
  }
};

/// A cube of 0.4 m.
struct alignas(64) RecordingPlace {
  static constexpr int kFreeLooks = 4;  ///< in a row, after which it has changed

  FirstVerdicts first;
  Presence kept;  ///< points by the first pass
  CellSamples samples;

  bool look_free = false, look_hit = false;      ///< of the open look
  bool was_hit = false;                          ///< by any look
  bool free_before = false, free_after = false;  ///< before, after any scan measured it
  std::uint8_t run = 0, longest = 0;             ///< free looks in a row
  std::uint32_t run_begin = 0;                   ///< first scan of the row
  ScanSpan passed;                               ///< of the longest row
  std::uint32_t last_free = 0;                   ///< last scan of the last look that passed it

  bool was_passed() const { return longest > 0; }
  /// Whether looks tell that what was measured in it came or went. Beams that pass what others hit
  /// tell of something porous.
  bool has_changed() const {
    const bool came = first.removed_first && free_before;
    const bool left = first.removed_last && free_after;
    return (first.any_kept && (came || left)) ||
           (longest >= kFreeLooks && !kept.any_within(passed));
  }
};

}  // namespace dynains
