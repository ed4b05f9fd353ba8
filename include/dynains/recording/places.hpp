// Places of a recording, and what all of its scans saw of them.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynains/belief/log_odds.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/cell_samples.hpp"
#include "dynains/recording/paged_tiles.hpp"
#include "dynains/recording/world_cells.hpp"
#include "dynains/verdict.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

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

/// A place of an object that came or went.
struct ChangedPlace {
  bool is_beside = false;       ///< no place has changed there, but most of those that touch it
  bool removed_last = false;    ///< the last epoch of first verdicts removed its points
  std::uint32_t last_free = 0;  ///< last scan of the last look that passed it

  /// Whether what a scan measured in it is there in the end of the recording: no later look passed
  /// it.
  bool stands_since(std::uint32_t scan) const { return !removed_last && scan > last_free; }
};

/// Places are cells of 0.4 m with points above the ground. The verdicts of the first pass on them
/// are kept by epochs. Then reference scans test the points of each place, in the order of their
/// times. References near each other in time and in the place of the sensor repeat the same error,
/// and are one look; an epoch is the same for scans. A look is free if beams passed the place and
/// none hit it. A place has changed by its state over time, not by the sum of its looks, in one of
/// these ways:
/// - kFreeLooks looks in a row are free, no hit lies between, and the first pass kept no points of
///   that time: beams that pass what others hit tell of something porous.
/// - An object came: looks passed the place before any scan measured it, and the first epoch
///   removed its points.
/// - An object left: the last epoch removed its points, and looks passed the place after it.
class RecordingPlaces {
 public:
  static constexpr double kLookWay = 3.0;   ///< m, of the sensor between independent looks
  static constexpr double kLookTime = 1.0;  ///< s, between independent looks

  /// `budget`: bytes in memory, if the places around the sensor take less; the others wait in the
  /// store, which outlives this, and what it throws comes out of all functions. Neither changes a
  /// result.
  RecordingPlaces(ByteStore& store, std::size_t budget) : tiles_(store, budget) {}

  /// Adds the places of the points above the ground of a scan (m, sensor frame). `time`: s. `scan`:
  /// its number; ascending.
  void add(PointsView points, Span<const PointLabel> verdicts, Span<const Cause> causes,
           const Pose& T_world_sensor, double time, std::uint32_t scan) {
    if (epoch_begin_.goes_by(T_world_sensor.translation(), time) && epoch_ < UINT16_MAX) ++epoch_;
    Place* place = nullptr;
    CellOfPoint at;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool is_removed = verdicts[i] == PointLabel::kDynamic;
      const bool is_above_ground =
          verdicts[i] == PointLabel::kStatic || (is_removed && causes[i] != Cause::kUnderInstance);
      if (!is_above_ground) continue;
      if (at.go_to(world_point(points, i, T_world_sensor))) {
        Tile& tile = tiles_.at(tile_of(at.cell()));
        place = &tile.values[tile.add(at.cell())];
      }
      if (!is_removed) place->kept.add(scan);
      // The first verdicts on points that are too far for looks say little of their place.
      const float squared = points.x[i] * points.x[i] + points.y[i] * points.y[i];
      const bool is_near = squared <= static_cast<float>(kLookRange * kLookRange);
      if (is_near) place->first.add(is_removed, epoch_, scan);
      place->samples.add(at.within());
    }
    free_far(T_world_sensor.translation());
  }

  /// Begins the test of the places around the sensor by a reference scan. `sensor`: m, world frame.
  /// `scan`: its number; ascending.
  void begin_test(std::uint32_t scan, double time, const Eigen::Vector3d& sensor) {
    if (look_begin_.goes_by(sensor, time)) {
      end_look();
      look_.first = scan;
    }
    look_.last = scan;
    free_far(sensor);
    sensor_ = sensor;
    around_.clear();
    next_around_ = 0;
    tiles_.for_each_index([&](const TileIndex& index) {
      if (tiles_.distance(index, sensor) <= kLookRange) around_.push_back(&tiles_.at(index));
    });
  }

  /// Tests places that no other call has taken, until none is left. Calls with different `part`, 0
  /// or 1, may run at the same time. `test_visibility(points, count)`: see
  /// detail::test_visibility(); points relative to the sensor, with the axes of the world frame.
  template <class TestVisibility>
  void test(std::size_t part, TestVisibility&& test_visibility) {
    TestedCells& tested = tested_[part];
    for (std::size_t next; (next = next_around_++) < around_.size();) {
      Tile& tile = *around_[next];
      tested.clear();
      for (std::uint32_t i = 0; i < tile.size(); ++i) {
        tested.add(i, tile.values[i].samples, corner_of(tile.keys[i]) - sensor_, kWorldCell);
      }
      if (tested.cells.empty()) continue;
      const auto& visibility = test_visibility(tested.samples, std::size_t{tested.begin.back()});
      for (std::size_t i = 0; i < tested.cells.size(); ++i) {
        const std::uint32_t begin = tested.begin[i], end = tested.begin[i + 1];
        const auto count = visibility.count(begin, end);
        const int verdict = detail::FreeSpaceSum::judge(count.free, count.hit, end - begin);
        if (verdict == 0) continue;
        Place& place = tile.values[tested.cells[i]];
        if (!place.look_free && !place.look_hit) touched_[part].push_back(&place);
        (verdict > 0 ? place.look_free : place.look_hit) = true;
      }
    }
  }

  /// Ends the last look, and decides on all places and objects: components of touching changed
  /// places that are large enough, and no part of something that stays. Nothing is tested then.
  void decide() {
    constexpr std::size_t kFewest = 6;    // places
    constexpr double kMostContact = 1.5;  // places that stay and touch it, ratio to its own places
    end_look();
    VoxelTile<Place> found;
    tiles_.for_each_index([&](const TileIndex& index) {
      const Tile& tile = *tiles_.find(index);
      for (std::size_t i = 0; i < tile.size(); ++i) {
        if (tile.values[i].has_changed()) found.values[found.add(tile.keys[i])] = tile.values[i];
      }
      tiles_.free_far(tiles_.middle(index), 0.0);
    });
    ComponentSearch().for_each(
        found.keys, found.numbers, [&](const std::vector<std::uint32_t>& members) {
          tiles_.free_far(corner_of(found.keys[members.front()]), 0.0);
          VoxelHashTable<> contacts;
          for (const std::uint32_t member : members) {
            for_each_touching(found.keys[member], [&](VoxelKey key) {
              const Place* const place = found.find(key) == nullptr ? find(key) : nullptr;
              if (place != nullptr && place->was_hit) contacts.insert(key);
            });
          }
          const auto size = static_cast<double>(members.size());
          if (members.size() < kFewest ||
              static_cast<double>(contacts.size()) > kMostContact * size)
            return;
          for (const std::uint32_t member : members) {
            const Place& place = found.values[member];
            changed_.values[changed_.add(found.keys[member])] = {false, place.first.removed_last,
                                                                 place.last_free};
          }
        });
    find_beside();
  }

  /// The changed place in a cell, or a cell beside, after decide(); null: nothing has changed.
  const ChangedPlace* changed(VoxelKey cell) const { return changed_.find(cell); }

  std::size_t size() const { return tiles_.size(); }
  /// Puts all places into the store.
  void rest() { tiles_.rest(); }

 private:
  using Place = RecordingPlace;
  using Tile = VoxelTile<Place>;

  /// Begin of a look or an epoch.
  struct Begin {
    bool is_set = false;
    double time = 0.0;                             // s
    Eigen::Vector3d at = Eigen::Vector3d::Zero();  // m, the sensor

    // Goes to a sensor that is too far, or too late, to belong to it. Returns whether it is.
    bool goes_by(const Eigen::Vector3d& sensor, double now) {
      if (is_set && (sensor - at).norm() < kLookWay && now - time < kLookTime) return false;
      *this = {true, now, sensor};
      return true;
    }
  };

  // Places of the open look stay in memory.
  void free_far(const Eigen::Vector3d& sensor) { tiles_.free_far(sensor, kLookRange + kLookWay); }

  // Adds the open look to the states of the places that it saw.
  void end_look() {
    for (std::vector<Place*>& touched : touched_) {
      for (Place* const place : touched) end_look(*place);
      touched.clear();
    }
  }
  void end_look(Place& place) const {
    if (place.look_hit) {
      place.was_hit = true;
      place.free_after = false;
      place.run = 0;
    } else {
      place.last_free = look_.last;
      if (!place.was_hit && look_.last < place.first.first_scan) place.free_before = true;
      if (look_.first > place.first.last_scan) place.free_after = true;
      if (place.run == 0) place.run_begin = look_.first;
      if (place.run < UINT8_MAX) ++place.run;
      if (place.run >= place.longest) {
        place.longest = place.run;
        place.passed = {place.run_begin, look_.last};
      }
    }
    place.look_free = place.look_hit = false;
  }

  // Finds the cells that touch more places of objects than ones that stay.
  void find_beside() {
    const std::size_t count = changed_.size();
    for (std::size_t i = 0; i < count; ++i) {
      tiles_.free_far(corner_of(changed_.keys[i]), 0.0);
      for_each_touching(changed_.keys[i], [&](VoxelKey cell) {
        if (changed_.find(cell) != nullptr) return;
        int majority = 0;
        for_each_touching(cell, [&](VoxelKey beside) {
          if (const std::uint32_t number = changed_.numbers.find(beside); number < count) {
            ++majority;
          } else if (const Place* const place = find(beside); place != nullptr) {
            majority -= place->was_hit || place->was_passed() ? 1 : 0;
          }
        });
        if (majority <= 0) return;
        ChangedPlace as_beside = changed_.values[i];
        as_beside.is_beside = true;
        changed_.values[changed_.add(cell)] = as_beside;
      });
    }
  }

  // Null: no scan brought a place there.
  const Place* find(VoxelKey cell) {
    const Tile* const tile = tiles_.find(tile_of(cell));
    return tile == nullptr ? nullptr : tile->find(cell);
  }

  PagedTiles<Tile> tiles_;
  VoxelTile<ChangedPlace> changed_;

  Begin epoch_begin_, look_begin_;
  std::uint16_t epoch_ = 0;
  ScanSpan look_;  // the open one

  Eigen::Vector3d sensor_ = Eigen::Vector3d::Zero();  // m, of the reference
  std::vector<Tile*> around_;                         // to be tested
  std::atomic<std::size_t> next_around_{0};           // the next one
  std::array<TestedCells, 2> tested_;                 // by part
  std::array<std::vector<Place*>, 2> touched_;        // by the open look
};

}  // namespace dynains
