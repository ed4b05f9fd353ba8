// One place of a recording: what its scans and the first pass tell of it.
#pragma once

#include <array>
#include <cstdint>

namespace dynains {

/// State of a place over the recording.
enum class PlaceState : std::uint8_t {
  kUnknown,  ///< no look sees it well
  kStays,
  kChanged  ///< looks in a row passed it: what was measured there came or went
};

/// Verdicts of the first pass on the points of a place, by epochs: scans that are near each other
/// in time and in the place of the sensor.
struct FirstVerdicts {
  std::uint16_t epoch = 0;                      ///< the open one
  std::uint8_t kept = 0, removed = 0;           ///< points in the open epoch
  std::uint8_t removed_first = 0;               ///< epochs that only removed, before all others
  std::uint8_t removed_last = 0;                ///< the same, after all others
  bool any_kept = false, any_removed = false;   ///< whether any epoch kept or removed points
  bool kept_first = false, kept_last = false;   ///< epochs before and after all that removed kept
  std::uint32_t first_scan = 0, last_scan = 0;  ///< that measured the place

  /// Adds a point. Epochs and scans ascend.
  void add(bool is_removed, std::uint16_t of_epoch, std::uint32_t scan) {
    const bool is_first = kept + removed == 0 && !any_kept && !any_removed;
    if (is_first) first_scan = scan;
    if (of_epoch != epoch) end_epoch();
    epoch = of_epoch;
    last_scan = scan;
    std::uint8_t& number = is_removed ? removed : kept;
    if (number < UINT8_MAX) ++number;
  }

  void end_epoch() {
    if (kept + removed == 0) return;
    const bool only_removed = kept == 0;
    if (removed == 0) kept_first = kept_first || !any_removed;
    kept_last = removed == 0;
    if (only_removed && !any_kept && removed_first < UINT8_MAX) ++removed_first;
    if (!only_removed) {
      removed_last = 0;
    } else if (removed_last < UINT8_MAX) {
      ++removed_last;
    }
    any_kept = any_kept || kept > 0;
    any_removed = any_removed || removed > 0;
    kept = removed = 0;
  }

  /// Whether the first or the last two epochs removed all points, and others did not.
  bool moved() const { return any_kept && (removed_first >= 2 || removed_last >= 2); }
};

/// A cube of 0.4 m.
struct RecordingPlace {
  std::array<std::array<std::uint8_t, 3>, 8> samples;  ///< by octant, in 1/256 of a place
  std::uint8_t filled = 0;                             ///< octants with a sample
  PlaceState state = PlaceState::kUnknown;
  std::uint8_t farthest = 0;                                 ///< m, range of its points
  std::uint8_t look_free = 0, look_hit = 0, look_range = 0;  ///< of the open look
  std::uint8_t hits = 0;                                     ///< looks
  bool was_free = false;                                     ///< some look passed it,
  bool free_before = false, free_after = false;              ///< before, after any scan measured it
  std::array<std::uint8_t, 4> run = {}, longest = {};        ///< free looks in a row, by range
  std::array<std::uint16_t, 4> run_begin = {}, begin = {}, end = {};  ///< looks
  FirstVerdicts first;
  std::uint32_t object = 0;  ///< number, from 1 on; 0: none

  bool was_passed() const { return longest.back() > 0; }
  /// Whether it was empty before the first pass saw something move into it, or after something
  /// moved out of it.
  bool came_or_left() const {
    return first.any_kept &&
           ((first.removed_first > 0 && free_before) || (first.removed_last > 0 && free_after));
  }
  /// Whether the first pass removed points of something that stands: it kept them before and after,
  /// and looks hit the place and never passed it.
  bool stands() const {
    constexpr std::uint8_t kFewestHits = 2;
    return first.any_removed && first.kept_first && first.kept_last && hits >= kFewestHits &&
           !was_free;
  }
};

}  // namespace dynains
