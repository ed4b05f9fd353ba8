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
#include "dynains/parameters.hpp"
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

/// Parameters of the second pass over a recording.
struct RecordingPlacesConfig {
  double place_range = 60;  ///< m
  double look_way = 3;      ///< m
  double look_time = 1;     ///< s
  int free_looks = 4;
  int object_places = 6;
  double most_contact = 1.5;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(Parameter{"place_range", self.place_range, closed(5, 300), "m",
                      "a scan does not look at places at a larger horizontal range"});
    visitor(Parameter{"look_way", self.look_way, closed(0, 100), "m",
                      "way of the sensor between two independent looks at a place"});
    visitor(Parameter{"look_time", self.look_time, closed(0.01, 1000), "s",
                      "time between two independent looks at a place"});
    visitor(Parameter{"free_looks", self.free_looks, closed(1, 100), "",
                      "independent looks in a row that must pass a place, and none hit it"});
    visitor(Parameter{"object_places", self.object_places, closed(1, 1000), "",
                      "places of an object that came or went, at least"});
    visitor(Parameter{"most_contact", self.most_contact, closed(0, 26), "",
                      "most places that stay and touch an object, ratio to its own places"});
  }

  /// Throws ConfigError.
  void validate() const { validate_parameters("RecordingPlaces", *this); }
};

/// Places are cells of 0.4 m with points above the ground. The verdicts of the first pass on them
/// are kept by epochs. Then reference scans test the points of each place, in the order of their
/// times. References near each other in time and in the place of the sensor repeat the same error,
/// and are one look; an epoch is the same for scans. A look is free if beams passed the place and
/// none hit it. A place has changed by its state over time, not by the sum of its looks, in one of
/// these ways:
/// - `free_looks` looks in a row are free, no hit lies between, and the first pass kept no points
///   of that time: beams that pass what others hit tell of something porous. Looks from farther
///   away than the points of a place within `place_range` do not count, for beams that are far
///   apart miss what is thin.
/// - An object came: looks passed the place before any scan measured it, and the first epoch
///   removed its points.
/// - An object left: the last epoch removed its points, and looks passed the place after it.
/// - It touches such places, and its first or last two epochs removed its points, or looks from
///   farther away tell one of the above.
///
/// A place takes about 170 bytes.
class RecordingPlaces {
 public:
  using Place = RecordingPlace;

  /// `budget`: bytes in memory, if the places around the sensor take less; the others wait in the
  /// store, which outlives this, and what it throws comes out of all functions. Neither changes a
  /// result. Throws ConfigError.
  RecordingPlaces(const RecordingPlacesConfig& config, ByteStore& store, std::size_t budget)
      : config_((config.validate(), config)), tiles_(store, budget) {}

  const RecordingPlacesConfig& config() const { return config_; }

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
          add_point(place, range_of(points, i), verdicts[i] == PointLabel::kDynamic, scan);
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
      if (tiles_.distance(index, sensor) > config_.place_range) return;
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
        place.look_range = std::max(place.look_range, tested.ranges[i]);
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
    find_standing();
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

  /// Whether points with a verdict are in places.
  static bool is_above_ground(PointLabel verdict) {
    return verdict == PointLabel::kStatic || verdict == PointLabel::kDynamic;
  }

  /// First and last scan of the longest row of looks that passed a place; was_passed() must be
  /// true.
  ScanSpan free_scans(const Place& place) const {
    const std::size_t k = class_of(place);
    return span_of(place, place.longest[k] > 0 ? k : kAnyRange);
  }
  /// Scans before a place that has changed was filled for the first time, or after the last time.
  /// All scans if it was empty in between.
  ScanSpan absence(const Place& place) const {
    const ScanSpan before = {0, place.first.first_scan - 1};
    const ScanSpan after = {place.first.last_scan + 1, UINT32_MAX};
    if (place.came(kAnyRange)) return before;
    if (place.left(kAnyRange)) return after;
    if (!place.first.moved()) return {};
    return place.first.removed_first >= 2 ? before : after;
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
  static constexpr std::array<std::uint8_t, 4> kNear = {12, 20, 35, 60};  // m
  static constexpr std::size_t kAnyRange = kNear.size() - 1;

  using Tile = VoxelTile<Place>;
  /// Places of one tile that a thread tests, and those that it saw in the open look.
  struct Tested {
    std::vector<Place*> touched;       // by the open look
    std::vector<Place*> places;        // of a tile
    std::vector<std::uint8_t> ranges;  // m, by place
    std::vector<std::uint32_t> begin;  // by place: first sample, and the end
    PointBuffer samples;
  };

  static std::uint8_t whole_metres(float metres) {
    return static_cast<std::uint8_t>(std::min(metres, 255.0F));
  }

  // The cell with this key in a tile.
  static WorldCell cell_of(const GroundTile& tile, VoxelKey key) {
    return {tile[0] * kTileCells + voxel_index(key, 0), tile[1] * kTileCells + voxel_index(key, 1),
            voxel_index(key, 2)};
  }

  // Horizontal, m.
  static float range_of(PointsView points, std::size_t i) {
    return std::sqrt(points.x[i] * points.x[i] + points.y[i] * points.y[i]);
  }

  // Adds a point of a scan. `range`: m. The first verdicts on points that are too far for looks say
  // little of their place.
  void add_point(Place& place, float range, bool is_removed, std::uint32_t scan) const {
    if (!is_removed) place.present.add(scan);
    if (range <= config_.place_range) {
      place.first.add(is_removed, epoch_, scan);
      place.farthest = std::max(place.farthest, std::max(whole_metres(range), std::uint8_t{1}));
    }
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
  void free_far(const Eigen::Vector3d& sensor) {
    tiles_.free_far(sensor, config_.place_range + config_.look_way);
  }

  void begin_reference(std::uint32_t scan, double time, const Eigen::Vector3d& sensor) {
    const bool is_near = has_look_ && (sensor - look_at_).norm() < config_.look_way &&
                         time - look_time_ < config_.look_time;
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
        place->free_after = 0;
        place->is_hit_at_last = true;
        place->run = {};
      } else {
        place->is_hit_at_last = false;
        place->last_free = look_scans_.back().second;
        const auto [first, last] = look_scans_.back();
        const bool is_before = place->hits == 0 && last < place->first.first_scan;
        const bool is_after = first > place->first.last_scan;
        for (std::size_t k = 0; k < kNear.size(); ++k) {
          if (place->look_range > kNear[k]) continue;
          const auto bit = static_cast<std::uint8_t>(1U << k);
          if (is_before) place->free_before |= bit;
          if (is_after) place->free_after |= bit;
          add_free(*place, k, look);
        }
      }
      place->look_free = place->look_hit = place->look_range = 0;
    }
    tested.touched.clear();
  }

  // Begins an epoch unless the sensor is near that of the open one.
  void begin_epoch(const Eigen::Vector3d& sensor, double time) {
    const bool is_near = epoch_ > 0 && (sensor - epoch_at_).norm() < config_.look_way &&
                         time - epoch_time_ < config_.look_time;
    if (is_near) return;
    if (epoch_ < UINT16_MAX) ++epoch_;
    epoch_at_ = sensor;
    epoch_time_ = time;
  }

  static void add_free(Place& place, std::size_t k, std::uint16_t look) {
    if (place.run[k] == 0) place.run_begin[k] = look;
    if (place.run[k] < 255) ++place.run[k];
    if (place.run[k] < place.longest[k]) return;
    place.longest[k] = place.run[k];
    place.begin[k] = place.run_begin[k];
    place.end[k] = look;
  }

  // The class of ranges from which looks at a place count: ranges at which it was measured, or all
  // if that was from too far only.
  static std::size_t class_of(const Place& place) {
    std::size_t k = kAnyRange;
    while (k > 0 && place.farthest > 0 && kNear[k] > place.farthest) --k;
    return k;
  }

  // Scans of the longest row of looks of a class of ranges that passed a place.
  ScanSpan span_of(const Place& place, std::size_t k) const {
    return {look_scans_[place.begin[k]].first, look_scans_[place.end[k]].second};
  }

  // Whether looks of a class of ranges tell that what was measured in a place came or went. Beams
  // that pass what others hit tell of something porous.
  bool has_changed(const Place& place, std::size_t k) const {
    const bool is_free = place.longest[k] >= config_.free_looks;
    return place.came(k) || place.left(k) ||
           (is_free && !place.present.any_within(span_of(place, k)));
  }

  // Whether a place has changed, by its own class of ranges or by all ranges.
  bool has_changed_by_any(const Place& place) const {
    return place.state == PlaceState::kChanged || has_changed(place, kAnyRange);
  }

  PlaceState state_of(Place& place) const {
    place.first.end_epoch();
    const std::size_t k = class_of(place);
    if (has_changed(place, k)) return PlaceState::kChanged;
    return place.hits > 0 || place.longest[k] > 0 ? PlaceState::kStays : PlaceState::kUnknown;
  }

  // A place of a tile.
  using Member = std::pair<GroundTile, std::uint32_t>;
  WorldCell cell_of(const Member& member) {
    return cell_of(member.first, tiles_.find(member.first)->keys[member.second]);
  }
  const Place& at(const Member& member) { return tiles_.find(member.first)->values[member.second]; }
  Place& change(const Member& member) { return tiles_.at(member.first).values[member.second]; }

  // Touching places, and the places beside them that limit them.
  struct Component {
    std::vector<Member> members, contacts;
  };

  // Grows a component from a place over those of which `joins(place)` and no other component has.
  // `is_contact(place)` chooses the others that touch it.
  template <class Joins, class IsContact>
  void grow(const Member& begin, Component& component, Joins&& joins, IsContact&& is_contact) {
    component.members.assign(1, begin);
    component.contacts.clear();
    change(begin).object = kNone;
    for (std::size_t i = 0; i < component.members.size(); ++i) {
      for_each_touching(cell_of(component.members[i]),
                        [&](const Member& beside, const Place& place) {
                          if (!joins(place)) {
                            if (is_contact(place)) component.contacts.push_back(beside);
                          } else if (place.object == 0) {
                            change(beside).object = kNone;
                            component.members.push_back(beside);
                          }
                        });
    }
    std::vector<Member>& contacts = component.contacts;
    std::sort(contacts.begin(), contacts.end());
    contacts.erase(std::unique(contacts.begin(), contacts.end()), contacts.end());
  }

  // Calls `visit(member)` for the places of which `is_taken(place)` at that time.
  template <class IsTaken, class Visitor>
  void for_each_member(IsTaken&& is_taken, Visitor&& visit) {
    tiles_.for_each_index([&](const GroundTile& index) {
      for (std::uint32_t number = 0; number < tiles_.find(index)->values.size(); ++number) {
        const Member member = {index, number};
        if (is_taken(at(member))) visit(member);
      }
      tiles_.free_far(tiles_.middle(index), 0.0);
    });
  }

  // Numbers the components of touching changed places, and of those beside them that the first pass
  // removed early or late.
  void find_objects() {
    std::vector<Member> rejected;
    Component component;
    const std::vector<Member>& members = component.members;
    const auto is_new = [](const Place& place) {
      return place.state == PlaceState::kChanged && place.object == 0;
    };
    const auto joins = [&](const Place& place) {
      return place.first.moved() || has_changed_by_any(place);
    };
    const auto stays = [](const Place& place) {
      return place.state == PlaceState::kStays && place.hits > 0;
    };
    for_each_member(is_new, [&](const Member& begin) {
      grow(begin, component, joins, stays);
      const bool is_object = is_whole(members, component.contacts.size());
      const std::uint32_t number = is_object ? ++objects_ : kNone;
      for (const Member& member : members) {
        Place& place = change(member);
        place.object = number;
        place.state = PlaceState::kChanged;
        if (is_object) changed_.mark(cell_of(member));
      }
      if (!is_object) rejected.insert(rejected.end(), members.begin(), members.end());
    });
    for (std::size_t i = 0; i < rejected.size(); ++i) {
      Place& place = change(rejected[i]);
      place.state = PlaceState::kStays;
      place.object = 0;
      const GroundTile& tile = rejected[i].first;
      if (i > 0 && tile != rejected[i - 1].first) tiles_.free_far(tiles_.middle(tile), 0.0);
    }
  }

  // Finds objects that are always there, of which the first pass removed points.
  void find_standing() {
    Component component;
    const auto joins = [](const Place& place) {
      return place.state != PlaceState::kChanged && place.first.any_removed() &&
             place.is_always_there();
    };
    const auto is_new = [&](const Place& place) { return place.object == 0 && joins(place); };
    const auto is_contact = [](const Place& place) {
      return place.was_passed() && !place.is_always_there();
    };
    for_each_member(is_new, [&](const Member& begin) {
      grow(begin, component, joins, is_contact);
      if (!is_standing(component)) return;
      for (const Member& member : component.members) change(member).stands_with_others = true;
    });
  }

  // Whether places that are always occupied are something that stands. Looks pass many places
  // beside what waits or sways, the first pass removes all of what creeps, and what comes or leaves
  // was removed first or last.
  bool is_standing(const Component& component) {
    constexpr std::size_t kFewestPlaces = 20;
    constexpr double kMostContact = 0.3;  // passed places beside it, ratio to its own places
    constexpr double kLeastKept = 0.1;    // of its points
    const std::size_t places = component.members.size();
    if (places < kFewestPlaces) return false;
    const auto contacts = static_cast<double>(component.contacts.size());
    if (contacts > kMostContact * static_cast<double>(places)) return false;
    std::uint64_t kept = 0, removed = 0;
    std::size_t moved = 0;
    for (const Member& member : component.members) {
      const FirstVerdicts& first = at(member).first;
      kept += first.sum_kept;
      removed += first.sum_removed;
      moved += first.moved() ? 1 : 0;
    }
    const bool is_kept =
        static_cast<double>(kept) >= kLeastKept * static_cast<double>(kept + removed);
    return is_kept && 2 * moved <= places;
  }

  // An object is large enough, no part of something that stays, and looks passed a third of it. The
  // places of which the first pass kept points are no part of it if looks passed less than a tenth
  // of them: a mover may have passed beside something that stands.
  bool is_whole(const std::vector<Member>& members, std::size_t contacts) {
    const auto fewest = static_cast<std::size_t>(config_.object_places);
    std::size_t changed = 0, kept = 0, passed = 0, passed_kept = 0;
    for (const Member& member : members) {
      const Place& place = at(member);
      const bool is_passed = has_changed_by_any(place);
      changed += place.state == PlaceState::kChanged ? 1 : 0;
      kept += place.first.any_kept() ? 1 : 0;
      passed += is_passed ? 1 : 0;
      passed_kept += is_passed && place.first.any_kept() ? 1 : 0;
    }
    const bool is_kept_part_passed = kept < fewest || 10 * passed_kept >= kept;
    return changed >= fewest && 3 * passed >= members.size() && is_kept_part_passed &&
           static_cast<double>(contacts) <= config_.most_contact * static_cast<double>(passed);
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
    tested.ranges.clear();
    tested.begin.assign(1, 0);
    const auto range = static_cast<float>(config_.place_range);
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
      const float metres = std::sqrt(x * x + y * y);
      if (metres > range) continue;
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
      tested.ranges.push_back(whole_metres(metres));
      tested.begin.push_back(count);
    }
  }

  RecordingPlacesConfig config_;
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
