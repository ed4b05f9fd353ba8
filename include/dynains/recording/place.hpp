// One place of a recording: what its scans and the first pass tell of it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace dynains {

/// State of a place over the recording.
enum class PlaceState : std::uint8_t {
  kUnknown,  ///< no look sees it well
  kStays,
  kChanged  ///< looks in a row passed it: what was measured there came or went
};

/// Scans from `first` to `last`.
struct ScanSpan {
  std::uint32_t first = 0, last = UINT32_MAX;
};

/// Scans in which something was in a place: 64 slices of time, which double when the recording
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
  std::uint16_t epoch = 0;                      ///< the open one
  std::uint16_t kept = 0, removed = 0;          ///< points in the open epoch
  bool removed_first = false;                   ///< the first epoch removed all points
  bool removed_last = false;                    ///< the last one did
  bool kept_first = false, kept_last = false;   ///< the first, the last epoch kept most points
  std::uint32_t sum_kept = 0, sum_removed = 0;  ///< points in the closed epochs
  std::uint32_t first_scan = 0, last_scan = 0;  ///< that measured the place

  /// Adds a point. Epochs and scans ascend.
  void add(bool is_removed, std::uint16_t of_epoch, std::uint32_t scan) {
    const bool is_first = kept + removed == 0 && !any_kept() && !any_removed();
    if (is_first) first_scan = scan;
    if (of_epoch != epoch) end_epoch();
    epoch = of_epoch;
    last_scan = scan;
    std::uint16_t& number = is_removed ? removed : kept;
    if (number < UINT16_MAX) ++number;
  }

  void end_epoch() {
    if (kept + removed == 0) return;
    kept_last = is_mostly_kept(kept, removed);
    removed_last = kept == 0;
    if (!any_kept() && !any_removed()) {
      kept_first = kept_last;
      removed_first = removed_last;
    }
    sum_kept += kept;
    sum_removed += removed;
    kept = removed = 0;
  }

  /// Whether any closed epoch kept, removed points.
  bool any_kept() const { return sum_kept > 0; }
  bool any_removed() const { return sum_removed > 0; }
  /// Whether twice as many points were kept as removed.
  static bool is_mostly_kept(std::uint32_t kept, std::uint32_t removed) {
    return kept >= 2 * removed;
  }
  /// Whether most points were kept at first, at last and in all.
  bool are_kept() const { return kept_first && kept_last && is_mostly_kept(sum_kept, sum_removed); }
};

/// A cube of 0.4 m. What a scan of the first pass changes lies in one line of the cache.
struct alignas(64) RecordingPlace {
  FirstVerdicts first;
  /// In scans that hit it, or of which the first pass kept points in it.
  Presence present;
  std::array<std::array<std::uint8_t, 3>, 8> samples;  ///< by octant, in 1/256 of a place
  std::uint8_t filled = 0;                             ///< octants with a sample

  PlaceState state = PlaceState::kUnknown;
  std::uint8_t look_free = 0, look_hit = 0;         ///< of the open look
  std::uint8_t hits = 0;                            ///< looks
  bool free_before = false, free_after = false;     ///< before, after any scan measured it
  std::uint8_t run = 0, longest = 0;                ///< free looks in a row
  std::uint16_t run_begin = 0, begin = 0, end = 0;  ///< looks
  std::uint32_t last_free = 0;                      ///< last scan of the last look that passed it
  std::uint32_t object = 0;                         ///< number, from 1 on, if the place has changed

  bool was_passed() const { return longest > 0; }
  /// Whether looks passed it before the first pass saw something move into it.
  bool came() const { return first.any_kept() && first.removed_first && free_before; }
  /// Whether looks passed it after the first pass saw something move out of it.
  bool left() const { return first.any_kept() && first.removed_last && free_after; }
  /// Whether what a scan measured in it is there in the end of the recording: no later look passed
  /// it.
  bool stands_since(std::uint32_t scan) const { return !first.removed_last && scan > last_free; }
  /// Whether the first pass removed points of something that stands: it kept most of them at
  /// both ends and in all, and some looks hit the place, and none passed it. Gaps pass in a queue
  /// that moves.
  bool stands() const {
    constexpr int kFewestHits = 2;
    return first.any_removed() && first.are_kept() && hits >= kFewestHits && !was_passed();
  }
};

}  // namespace dynains
