// Places of a recording, and what all of its scans saw of them.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "dynains/belief/log_odds.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/marked_columns.hpp"
#include "dynains/recording/paged_tiles.hpp"
#include "dynains/recording/place.hpp"
#include "dynains/recording/world_cells.hpp"
#include "dynains/simd/bits.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/verdict.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

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
///
/// A place takes about 130 bytes.
class RecordingPlaces {
 public:
  using Place = RecordingPlace;

  static constexpr double kPlaceRange = 60.0;  ///< m, horizontal, of a look at a place
  static constexpr double kLookWay = 3.0;      ///< m, of the sensor between independent looks
  static constexpr double kLookTime = 1.0;     ///< s, between independent looks
  static constexpr int kFreeLooks = 4;

  /// `budget`: bytes in memory, if the places around the sensor take less; the others wait in the
  /// store, which outlives this, and what it throws comes out of all functions. Neither changes a
  /// result.
  RecordingPlaces(ByteStore& store, std::size_t budget) : tiles_(store, budget) {}

  /// Adds the places of the points above the ground of a scan (m, sensor frame). `time`: s. `scan`:
  /// its number; ascending.
  void add(PointsView points, Span<const PointLabel> verdicts, Span<const Cause> causes,
           const Pose& T_world_sensor, double time, std::uint32_t scan) {
    begin_epoch(T_world_sensor.translation(), time);
    const auto is_taken = [&](std::size_t i) {
      return is_above_ground(verdicts[i]) &&
             (verdicts[i] != PointLabel::kDynamic || causes[i] != Cause::kUnderInstance);
    };
    for_each_located(points, T_world_sensor, is_taken, [&](const LocatedPoints& located) {
      const Span<const LocatedPoints::Run> runs = located.runs();
      std::array<Tile*, LocatedPoints::kMost> tiles;
      std::array<std::uint32_t, LocatedPoints::kMost> numbers;
      for (std::size_t r = 0; r < runs.size(); ++r) {
        tiles[r] = &tiles_.at(tile_of(runs[r].cell));
        tiles[r]->numbers.prefetch(key_of(runs[r].cell));
      }
      for (std::size_t r = 0; r < runs.size(); ++r) {
        numbers[r] = tiles[r]->add(key_of(runs[r].cell));
        __builtin_prefetch(&tiles[r]->values[numbers[r]], 1);
      }
      for (std::size_t r = 0; r < runs.size(); ++r) {
        Place& place = tiles[r]->values[numbers[r]];
        for (std::size_t k = runs[r].begin; k < runs[r].end; ++k) {
          const std::size_t i = located.point(k);
          const bool is_removed = verdicts[i] == PointLabel::kDynamic;
          if (!is_removed) place.present.add(scan);
          // The first verdicts on points that are too far for looks say little of their place.
          if (range_of(points, i) <= kPlaceRange) place.first.add(is_removed, epoch_, scan);
          add_sample(place, located, k);
        }
      }
    });
    free_far(T_world_sensor.translation());
  }

  /// Begins the test of the places around the sensor by a reference scan. `sensor`: m, world frame.
  /// `scan`: its number; ascending.
  void begin_test(std::uint32_t scan, double time, const Eigen::Vector3d& sensor) {
    begin_reference(scan, time, sensor);
    free_far(sensor);
    sensor_ = sensor;
    around_.clear();
    next_around_ = 0;
    tiles_.for_each_index([&](const GroundTile& index) {
      if (tiles_.distance(index, sensor) > kPlaceRange) return;
      around_.emplace_back(index, &tiles_.at(index));
    });
  }

  /// Tests places that no other call has taken, until none is left. Calls with different `part`, 0
  /// or 1, may run at the same time. `test_visibility(points, count)`: see
  /// detail::test_visibility(); points relative to the sensor, with the axes of the world frame.
  template <class TestVisibility>
  void test(std::size_t part, TestVisibility&& test_visibility) {
    Tested& tested = tested_[part];
    for (std::size_t next; (next = next_around_++) < around_.size();) {
      gather(around_[next].first, *around_[next].second, tested);
      if (tested.places.empty()) continue;
      const auto& visibility = test_visibility(tested.samples, std::size_t{tested.begin.back()});
      for (std::size_t i = 0; i < tested.places.size(); ++i) {
        const std::uint32_t begin = tested.begin[i], end = tested.begin[i + 1];
        const auto count = visibility.count(begin, end);
        const int verdict = detail::FreeSpaceSum::judge(count.free, count.hit, end - begin);
        if (verdict == 0) continue;
        Place& place = *tested.places[i];
        if (place.look_free == 0 && place.look_hit == 0) tested.touched.push_back(&place);
        if (verdict < 0) place.present.add(look_scans_.back().second);
        std::uint8_t& number = verdict > 0 ? place.look_free : place.look_hit;
        if (number < 255) ++number;
      }
    }
  }

  /// Ends the last look, and decides on all places and objects.
  void decide() {
    end_look();
    tiles_.for_each_index([&](const GroundTile& index) {
      for (Place& place : tiles_.at(index).values) place.state = state_of(place);
      tiles_.free_far(tiles_.middle(index), 0.0);
    });
    find_objects();
  }

  /// Begins a scan: sets `is_near` to 0 for its points (m, sensor frame) whose places, and all that
  /// touch them, have not changed; to 1 for others. After decide(). Places that are found then are
  /// valid until the next scan.
  void begin_scan(PointsView points, const Pose& T_world_sensor,
                  std::vector<std::uint8_t>& is_near) {
    free_far(T_world_sensor.translation());
    changed_.find(points, T_world_sensor, is_near);
  }
  /// Calls `visit(i, place)` for the points (m, sensor frame) of which `is_taken(i)`; null: no scan
  /// brought a place there.
  template <class IsTaken, class Visitor>
  void for_each_place(PointsView points, const Pose& T_world_sensor, IsTaken&& is_taken,
                      Visitor&& visit) {
    for_each_located(points, T_world_sensor, is_taken, [&](const LocatedPoints& located) {
      const Span<const LocatedPoints::Run> runs = located.runs();
      std::array<const Tile*, LocatedPoints::kMost> tiles;
      std::array<const Place*, LocatedPoints::kMost> places;
      for (std::size_t r = 0; r < runs.size(); ++r) {
        tiles[r] = tiles_.find(tile_of(runs[r].cell));
        if (tiles[r] != nullptr) tiles[r]->numbers.prefetch(key_of(runs[r].cell));
      }
      for (std::size_t r = 0; r < runs.size(); ++r) {
        places[r] = tiles[r] == nullptr ? nullptr : tiles[r]->find(key_of(runs[r].cell));
        __builtin_prefetch(places[r]);
      }
      for (std::size_t r = 0; r < runs.size(); ++r) {
        for (std::size_t k = runs[r].begin; k < runs[r].end; ++k)
          visit(located.point(k), places[r]);
      }
    });
  }

  /// The place in a cell; null: no scan brought a place there.
  const Place* find(const WorldCell& cell) {
    const Tile* const tile = tiles_.find(tile_of(cell));
    return tile == nullptr ? nullptr : tile->find(key_of(cell));
  }
  /// A place that has changed and touches a cell, if more such places than ones that stay touch it;
  /// else null.
  const Place* changed_beside(const WorldCell& cell) {
    const Place* found = nullptr;
    int majority = 0;
    for_each_touching(cell, [&](const Member&, const Place& place) {
      if (place.state == PlaceState::kChanged) found = &place;
      majority += place.state == PlaceState::kChanged ? 1 : 0;
      majority -= place.state == PlaceState::kStays ? 1 : 0;
    });
    return majority > 0 ? found : nullptr;
  }

  std::size_t size() const { return tiles_.size(); }
  /// Puts all places into the store.
  void rest() { tiles_.rest(); }

  /// Whether points with a verdict are in places.
  static bool is_above_ground(PointLabel verdict) {
    return verdict == PointLabel::kStatic || verdict == PointLabel::kDynamic;
  }

  /// Scans of the longest row of looks that passed a place; was_passed() must be true.
  ScanSpan free_scans(const Place& place) const {
    return {look_scans_[place.begin].first, look_scans_[place.end].second};
  }
  std::uint32_t object_count() const { return objects_; }

  /// Calls `visit(middle, place)` for all places; m, world frame.
  template <class Visitor>
  void for_each(Visitor&& visit) {
    tiles_.for_each_index([&](const GroundTile& index) {
      const Tile& tile = *tiles_.find(index);
      for (std::size_t i = 0; i < tile.values.size(); ++i) {
        const WorldCell cell = cell_of(index, tile.keys[i]);
        Eigen::Vector3d middle;
        for (int axis = 0; axis < 3; ++axis) {
          middle[axis] =
              kWorldCell * (static_cast<double>(cell[static_cast<std::size_t>(axis)]) + 0.5);
        }
        visit(middle, tile.values[i]);
      }
      tiles_.free_far(tiles_.middle(index), 0.0);
    });
  }

 private:
  static constexpr std::uint32_t kNone = VoxelHashTable<>::kNone;

  using Tile = VoxelTile<Place>;
  /// Places of one tile that a thread tests, and those that it saw in the open look.
  struct Tested {
    std::vector<Place*> touched;       // by the open look
    std::vector<Place*> places;        // of a tile
    std::vector<std::uint32_t> begin;  // by place: first sample, and the end
    PointBuffer samples;
  };

  // The cell with this key in a tile.
  static WorldCell cell_of(const GroundTile& tile, VoxelKey key) {
    return {tile[0] * kTileCells + voxel_index(key, 0), tile[1] * kTileCells + voxel_index(key, 1),
            voxel_index(key, 2)};
  }

  // Horizontal, m.
  static float range_of(PointsView points, std::size_t i) {
    return std::sqrt(points.x[i] * points.x[i] + points.y[i] * points.y[i]);
  }

  // The first point of an octant is its sample.
  static void add_sample(Place& place, const LocatedPoints& located, std::size_t k) {
    const std::array<std::uint8_t, 3> within = {located.within(0, k), located.within(1, k),
                                                located.within(2, k)};
    std::size_t octant = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      octant |= static_cast<std::size_t>(within[axis] >> 7U) << axis;
    }
    const auto bit = static_cast<std::uint8_t>(1U << octant);
    if ((place.filled & bit) != 0) return;
    place.filled = static_cast<std::uint8_t>(place.filled | bit);
    place.samples[octant] = within;
  }

  // Places of the open look stay in memory.
  void free_far(const Eigen::Vector3d& sensor) { tiles_.free_far(sensor, kPlaceRange + kLookWay); }

  void begin_reference(std::uint32_t scan, double time, const Eigen::Vector3d& sensor) {
    const bool is_near =
        has_look_ && (sensor - look_at_).norm() < kLookWay && time - look_time_ < kLookTime;
    if (is_near) {
      look_scans_.back().second = scan;
      return;
    }
    if (has_look_) end_look();
    has_look_ = true;
    look_at_ = sensor;
    look_time_ = time;
    look_scans_.push_back({scan, scan});
  }

  // Adds the open look to the states of the places that it saw.
  void end_look() {
    if (look_scans_.empty()) return;
    const auto look =
        static_cast<std::uint16_t>(std::min<std::size_t>(look_scans_.size() - 1, UINT16_MAX));
    for (Tested& tested : tested_) end_look(tested, look);
  }

  void end_look(Tested& tested, std::uint16_t look) const {
    for (Place* const place : tested.touched) {
      if (place->look_hit > 0) {
        const bool is_hit = place->look_hit >= place->look_free;
        if (is_hit && place->hits < 255) ++place->hits;
        place->free_after = false;
        place->run = 0;
      } else {
        place->last_free = look_scans_.back().second;
        const auto [first, last] = look_scans_.back();
        if (place->hits == 0 && last < place->first.first_scan) place->free_before = true;
        if (first > place->first.last_scan) place->free_after = true;
        add_free(*place, look);
      }
      place->look_free = place->look_hit = 0;
    }
    tested.touched.clear();
  }

  // Begins an epoch unless the sensor is near that of the open one.
  void begin_epoch(const Eigen::Vector3d& sensor, double time) {
    const bool is_near =
        epoch_ > 0 && (sensor - epoch_at_).norm() < kLookWay && time - epoch_time_ < kLookTime;
    if (is_near) return;
    if (epoch_ < UINT16_MAX) ++epoch_;
    epoch_at_ = sensor;
    epoch_time_ = time;
  }

  static void add_free(Place& place, std::uint16_t look) {
    if (place.run == 0) place.run_begin = look;
    if (place.run < 255) ++place.run;
    if (place.run < place.longest) return;
    place.longest = place.run;
    place.begin = place.run_begin;
    place.end = look;
  }

  // Whether looks tell that what was measured in a place came or went. Beams that pass what others
  // hit tell of something porous.
  bool has_changed(const Place& place) const {
    const bool is_free = place.longest >= kFreeLooks;
    return place.came() || place.left() ||
           (is_free && !place.present.any_within(free_scans(place)));
  }

  PlaceState state_of(Place& place) const {
    place.first.end_epoch();
    if (has_changed(place)) return PlaceState::kChanged;
    return place.hits > 0 || place.was_passed() ? PlaceState::kStays : PlaceState::kUnknown;
  }

  // A place of a tile.
  using Member = std::pair<GroundTile, std::uint32_t>;
  WorldCell cell_of(const Member& member) {
    return cell_of(member.first, tiles_.find(member.first)->keys[member.second]);
  }
  const Place& at(const Member& member) { return tiles_.find(member.first)->values[member.second]; }
  Place& change(const Member& member) { return tiles_.at(member.first).values[member.second]; }

  // Grows touching places that have changed from one of them. Returns the number of places that
  // stay and touch them.
  std::size_t grow(const Member& begin, std::vector<Member>& members) {
    members.assign(1, begin);
    std::vector<Member> contacts;
    change(begin).object = kNone;
    for (std::size_t i = 0; i < members.size(); ++i) {
      for_each_touching(cell_of(members[i]), [&](const Member& beside, const Place& place) {
        if (place.state == PlaceState::kStays && place.hits > 0) contacts.push_back(beside);
        if (place.state != PlaceState::kChanged || place.object != 0) return;
        change(beside).object = kNone;
        members.push_back(beside);
      });
    }
    std::sort(contacts.begin(), contacts.end());
    const auto end = std::unique(contacts.begin(), contacts.end());
    return static_cast<std::size_t>(end - contacts.begin());
  }

  // Numbers the objects: components of touching changed places that are large enough, and no part
  // of something that stays.
  void find_objects() {
    constexpr std::size_t kFewest = 6;    // places
    constexpr double kMostContact = 1.5;  // places that stay and touch it, ratio to its own places
    std::vector<Member> members, rejected;
    const auto find_from = [&](const Member& begin) {
      const auto contacts = static_cast<double>(grow(begin, members));
      const bool is_object = members.size() >= kFewest &&
                             contacts <= kMostContact * static_cast<double>(members.size());
      const std::uint32_t number = is_object ? ++objects_ : kNone;
      for (const Member& member : members) {
        change(member).object = number;
        if (is_object) changed_.mark(cell_of(member));
      }
      if (!is_object) rejected.insert(rejected.end(), members.begin(), members.end());
    };
    tiles_.for_each_index([&](const GroundTile& index) {
      for (std::uint32_t number = 0; number < tiles_.find(index)->values.size(); ++number) {
        const Place& place = at({index, number});
        if (place.state == PlaceState::kChanged && place.object == 0) find_from({index, number});
      }
      tiles_.free_far(tiles_.middle(index), 0.0);
    });
    for (std::size_t i = 0; i < rejected.size(); ++i) {
      Place& place = change(rejected[i]);
      place.state = PlaceState::kStays;
      place.object = 0;
      const GroundTile& tile = rejected[i].first;
      if (i > 0 && tile != rejected[i - 1].first) tiles_.free_far(tiles_.middle(tile), 0.0);
    }
  }

  // Calls `visit(member, place)` for the places in a cell and in those that touch it.
  template <class Visitor>
  void for_each_touching(const WorldCell& cell, Visitor&& visit) {
    for (int n = 0; n < 27; ++n) {
      const WorldCell beside = {cell[0] + n % 3 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n / 9 - 1};
      const Tile* const tile = tiles_.find(tile_of(beside));
      const std::uint32_t number = tile == nullptr ? kNone : tile->numbers.find(key_of(beside));
      if (number != kNone) visit(Member{tile_of(beside), number}, tile->values[number]);
    }
  }

  // Collects the samples of the places of a tile that are near the sensor.
  void gather(const GroundTile& index, Tile& tile, Tested& tested) const {
    tested.places.clear();
    tested.begin.assign(1, 0);
    const auto range = static_cast<float>(kPlaceRange);
    constexpr auto kStep = static_cast<float>(kWorldCell / 256.0);
    const Eigen::Vector3f corner =
        (kTileEdge *
             Eigen::Vector3d(static_cast<double>(index[0]), static_cast<double>(index[1]), 0.0) -
         sensor_)
            .cast<float>();
    PointBuffer& samples = tested.samples;
    for (std::size_t i = 0; i < tile.values.size(); ++i) {
      const VoxelKey key = tile.keys[i];
      const auto at = [&](int axis) {
        return corner[axis] +
               static_cast<float>(kWorldCell) * static_cast<float>(voxel_index(key, axis));
      };
      const float x = at(0), y = at(1), z = at(2);
      if (x * x + y * y > range * range) continue;
      Place& place = tile.values[i];
      std::uint32_t count = tested.begin.back();
      samples.grow(count + 8 + detail::kPackWidth);
      detail::for_each_bit(place.filled, [&](std::size_t octant) {
        const std::array<std::uint8_t, 3>& within = place.samples[octant];
        samples.x[count] = x + kStep * (static_cast<float>(within[0]) + 0.5F);
        samples.y[count] = y + kStep * (static_cast<float>(within[1]) + 0.5F);
        samples.z[count] = z + kStep * (static_cast<float>(within[2]) + 0.5F);
        ++count;
      });
      tested.places.push_back(&place);
      tested.begin.push_back(count);
    }
  }

  PagedTiles<Tile> tiles_;
  MarkedColumns changed_;
  std::uint32_t objects_ = 0;

  std::uint16_t epoch_ = 0;
  Eigen::Vector3d epoch_at_ = Eigen::Vector3d::Zero();  // m, sensor at the begin of the epoch
  double epoch_time_ = 0.0;                             // s
  bool has_look_ = false;
  Eigen::Vector3d look_at_ = Eigen::Vector3d::Zero();  // m, sensor at the begin of the look
  double look_time_ = 0.0;                             // s
  std::vector<std::pair<std::uint32_t, std::uint32_t>> look_scans_;  // first and last, by look

  Eigen::Vector3d sensor_ = Eigen::Vector3d::Zero();  // m, of the reference
  std::vector<std::pair<GroundTile, Tile*>> around_;  // to be tested
  std::atomic<std::size_t> next_around_{0};           // the next one
  std::array<Tested, 2> tested_;                      // by part
};

}  // namespace dynains
