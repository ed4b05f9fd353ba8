// Places of a recording, and the evidence of all its scans on them.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <vector>

#include "dynains/belief/log_odds.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/cell_samples.hpp"
#include "dynains/recording/paged_tiles.hpp"
#include "dynains/recording/world_cells.hpp"
#include "dynains/simd/pack_loops.hpp"
#include "dynains/verdict.hpp"
#include "dynains/voxels/voxel_hash_table.hpp"

namespace dynains {

/// Numbers the epochs of a visit. The scans of an epoch are near each other in time and in the
/// place of the sensor, so they repeat the same errors and count as one observation.
class Epochs {
 public:
  static constexpr double kWay = 3.0;   ///< m, of the sensor
  static constexpr double kTime = 1.0;  ///< s

  /// The epoch of the next scan, counted from 1. `sensor`: m.
  std::uint16_t next(const Eigen::Vector3d& sensor, double time) {
    if (number_ > 0 && (sensor - begin_at_).norm() < kWay && time - begin_ < kTime) return number_;
    begin_at_ = sensor;
    begin_ = time;
    if (number_ < UINT16_MAX) ++number_;
    return number_;
  }

 private:
  std::uint16_t number_ = 0;
  double begin_ = 0.0;                                  // s
  Eigen::Vector3d begin_at_ = Eigen::Vector3d::Zero();  // m
};

/// Epochs in which something was seen in a place: 64 slices of time, which double when the
/// recording gets longer.
class Presence {
 public:
  void add(std::uint32_t epoch) {
    for (; epoch >> shift_ >= kSlices; ++shift_) fold();
    bits_ |= std::uint64_t{1} << (epoch >> shift_);
  }
  /// Whether something was there in a slice that lies in the epochs `first` to `last` as a whole.
  bool any_within(std::uint32_t first, std::uint32_t last) const {
    const std::uint32_t begin = (first + (1U << shift_) - 1) >> shift_;
    const std::uint32_t end = std::min(kSlices, (last + 1) >> shift_);
    return begin < end && bits_ >> begin << (kSlices - (end - begin)) != 0;
  }

 private:
  static constexpr std::uint32_t kSlices = 64;

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

/// Verdicts of the first pass on the points of a place, by epochs.
struct FirstVerdicts {
  std::uint16_t first_epoch = 0, last_epoch = 0;  ///< that measured the place; 0: none
  bool removed_first = true;                      ///< the first epoch removed all points
  bool removed_last = false;                      ///< the last one did
  bool any_kept = false;

  /// Adds a point. Epochs ascend.
  void add(bool is_removed, std::uint16_t epoch) {
    if (first_epoch == 0) first_epoch = epoch;
    removed_last = is_removed && (removed_last || epoch != last_epoch);
    removed_first = removed_first && (is_removed || epoch != first_epoch);
    any_kept = any_kept || !is_removed;
    last_epoch = epoch;
  }
};

/// A cube of 0.4 m. It fills a cache line.
struct alignas(64) RecordingPlace {
  static constexpr int kFreeObservations = 4;  ///< in a row, after which it has changed

  FirstVerdicts first;
  Presence kept;  ///< points by the first pass
  CellSamples samples;

  /// Result of the references of one epoch together.
  enum class Observation : std::uint8_t { kNone, kFree, kHit };
  Observation observation = Observation::kNone;     ///< by the current epoch
  std::uint16_t run_begin = 0;                      ///< first epoch of the row of free ones
  std::uint16_t passed_first = 0, passed_last = 0;  ///< epochs of the longest row
  std::uint16_t last_free = 0;                      ///< last epoch that saw it free
  std::uint8_t run = 0, longest = 0;                ///< free observations in a row
  bool was_hit = false;                             ///< in any observation
  bool free_before = false, free_after = false;     ///< before, after any epoch measured it

  /// Whether an object came to this place or left it. It came if the place was free before any
  /// epoch measured points in it, and the first pass removed the points of the first such epoch. It
  /// left if the place was free after all of these epochs, and the first pass removed the points of
  /// the last one. It also came or left if kFreeObservations observations in a row are free, and
  /// the first pass kept no points of that time: kept points where beams pass belong to porous
  /// objects.
  bool has_changed() const {
    const bool came = first.removed_first && free_before;
    const bool left = first.removed_last && free_after;
    return (first.any_kept && (came || left)) ||
           (longest >= kFreeObservations && !kept.any_within(passed_first, passed_last));
  }
  /// Adds the observation of the current epoch, `epoch`, to the state.
  void end_observation(std::uint16_t epoch) {
    if (observation == Observation::kHit) {
      was_hit = true;
      free_after = false;
      run = 0;
    } else {
      last_free = epoch;
      if (!was_hit && epoch < first.first_epoch) free_before = true;
      if (epoch > first.last_epoch) free_after = true;
      if (run == 0) run_begin = epoch;
      if (run < UINT8_MAX) ++run;
      if (run >= longest) {
        longest = run;
        passed_first = run_begin;
        passed_last = epoch;
      }
    }
    observation = Observation::kNone;
  }
};

/// A place of an object that came or went.
struct ChangedPlace {
  bool removed_last = false;    ///< the last epoch of first verdicts removed its points
  std::uint16_t last_free = 0;  ///< last epoch that saw it free

  /// Whether the points that an epoch measured in it are there until the end of the recording: no
  /// later epoch saw it free.
  bool stands_since(std::uint16_t epoch) const { return !removed_last && epoch > last_free; }
};

/// The ground in a column of cells.
struct GroundColumn {
  double height_sum = 0.0;  ///< m
  std::uint32_t count = 0;  ///< of points

  double mean() const { return height_sum / static_cast<double>(count); }
};

/// The places and the ground of a tile.
struct RecordingTile {
  VoxelTile<RecordingPlace> places;
  std::vector<GroundColumn> ground = std::vector<GroundColumn>(1U << 2 * kTileShift);

  /// The ground in the column of a cell.
  static std::size_t column(VoxelKey cell) {
    const auto index = [&](int axis) { return voxel_index(cell, axis) & ((1 << kTileShift) - 1); };
    return static_cast<std::size_t>(index(0) << kTileShift | index(1));
  }
  /// The samples of all places; none is added then.
  const TestedCells& tested() {
    tested_.take(places.keys, kWorldCell,
                 [&](std::size_t i) -> const CellSamples& { return places.values[i].samples; });
    return tested_;
  }
  std::size_t size() const { return places.size(); }
  std::size_t memory_bytes() const {
    return places.memory_bytes() + ground_bytes() + tested_.memory_bytes();
  }
  void pack(std::vector<std::uint8_t>& bytes) const {
    places.pack(bytes);
    add_bytes(ground.data(), ground.size(), bytes);
  }
  void unpack(const std::uint8_t* bytes) {
    std::memcpy(ground.data(), places.unpack(bytes), ground_bytes());
  }

 private:
  std::size_t ground_bytes() const { return ground.size() * sizeof(GroundColumn); }

  TestedCells tested_;
};

/// Places are cells of 0.4 m with points above the ground. The verdicts of the first pass on them
/// are kept by epochs. Then reference scans test the points of each place, in the order of their
/// times. The references of an epoch make one observation, which is free if beams passed the place
/// and none hit it. The order of the observations in time, not their sum, decides whether a place
/// has changed. The height of the ground is the mean of all scans, because single scans are noisy
/// and miss occluded ground.
class RecordingPlaces {
 public:
  /// `budget`: bytes in memory, unless the places around the sensor take more; the others wait in
  /// `store`, which outlives this. All functions throw the exceptions of the store. Neither changes
  /// a result.
  RecordingPlaces(ByteStore& store, std::size_t budget) : tiles_(store, budget) {}

  /// Adds the points of a scan (m, sensor frame): places of points above the ground, and the
  /// ground. Epochs ascend.
  void add(PointsView points, Span<const PointLabel> verdicts, Span<const Cause> causes,
           const Pose& T_world_sensor, std::uint16_t epoch) {
    std::array<Added, 128> batch;
    std::size_t count = 0;
    const auto add_batch = [&] {
      add_places({batch.data(), count}, points, verdicts, T_world_sensor, epoch);
      count = 0;
    };
    for_each_in_cells(points, T_world_sensor, [&](std::size_t i, auto&& cell_of, unsigned octant) {
      if (verdicts[i] == PointLabel::kGround) {
        const VoxelKey cell = cell_of();
        GroundColumn& ground = tiles_.at(tile_of(cell)).ground[Tile::column(cell)];
        ground.height_sum += world_point(points, i, T_world_sensor).z();
        ++ground.count;
      } else if (verdicts[i] == PointLabel::kStatic ||
                 (verdicts[i] == PointLabel::kDynamic && causes[i] != Cause::kUnderInstance)) {
        Added& added = batch[count++];
        added.i = i;
        added.octant = octant;
        added.cell = cell_of();
        added.places = &tiles_.at(tile_of(added.cell)).places;
        added.places->numbers.prefetch(added.cell);
        if (count == batch.size()) add_batch();
      }
    });
    add_batch();
    free_far(T_world_sensor.translation());
  }

  /// Moves tiles far from a sensor (m, world frame) to the store as long as the budget is exceeded.
  /// Places of the current observation stay in memory.
  void free_far(const Eigen::Vector3d& sensor) {
    tiles_.free_far(sensor, kTestRange + Epochs::kWay);
  }

  /// Height of a point (m, world frame) above the ground, m, if there is ground in its column.
  std::optional<double> rise(const Eigen::Vector3d& point) {
    const GroundColumn* const ground = find_ground(cell_at(point));
    if (ground == nullptr) return std::nullopt;
    return point.z() - ground->mean();
  }

  /// Whether no ground within 0.8 m of the column of a point is 0.2 m lower than its own.
  bool is_level(const Eigen::Vector3d& point) {
    constexpr int kReach = 2;      // columns
    constexpr double kStep = 0.2;  // m
    const VoxelKey column = cell_at(point);
    const GroundColumn* const own = find_ground(column);
    if (own == nullptr) return false;
    const double lowest = own->mean() - kStep;
    for (int x = -kReach; x <= kReach; ++x) {
      for (int y = -kReach; y <= kReach; ++y) {
        const GroundColumn* const beside = find_ground(column + voxel_key_step(x, y, 0));
        if (beside != nullptr && beside->mean() < lowest) return false;
      }
    }
    return true;
  }

  /// Tests the places around the sensor by a reference scan. `sensor`: m, world frame. Epochs
  /// ascend. `test_visibility`: see TestedCells::test().
  template <class TestVisibility>
  void test(std::uint16_t epoch, const Eigen::Vector3d& sensor, TestVisibility&& test_visibility) {
    if (epoch != epoch_) end_observation();
    epoch_ = epoch;
    free_far(sensor);
    tiles_.for_each_index([&](const TileIndex& index) {
      if (tiles_.distance(index, sensor) > kTestRange) return;
      Tile& tile = tiles_.at(index);
      const auto visit = [&](std::size_t i, const detail::Visibility::Bits& seen) {
        Place& place = tile.places.values[i];
        const auto [free, hit] = seen.count();
        const int verdict = detail::FreeSpaceSum::judge(
            free, hit, detail::count_ones(std::uint64_t{place.samples.octants}));
        if (verdict == 0) return;
        using Observation = Place::Observation;
        if (place.observation == Observation::kNone) touched_.push_back(&place);
        place.observation =
            std::max(place.observation, verdict > 0 ? Observation::kFree : Observation::kHit);
      };
      tile.tested().test(sensor, test_visibility, visit);
    });
  }

  /// Ends the last observation and decides on all places and objects: components of touching
  /// changed places that are large enough and not part of a static object. No test may follow.
  void decide() {
    end_observation();
    VoxelTile<Place> found;
    tiles_.for_each_index([&](const TileIndex& index) {
      const VoxelTile<Place>& tile = tiles_.find(index)->places;
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
          // An object that touches more unchanged places than it has itself is a part of them.
          if (members.size() < 6 || 2 * contacts.size() > 3 * members.size()) return;
          for (const std::uint32_t member : members) {
            const Place& place = found.values[member];
            changed_.values[changed_.add(found.keys[member])] = {place.first.removed_last,
                                                                 place.last_free};
          }
        });
    changed_.numbers.reserve(8 * changed_.size());  // most searches end at once: nothing is there
  }

  /// The changed place in a cell, after decide(); null: nothing has changed.
  const ChangedPlace* changed(VoxelKey cell) const { return changed_.find(cell); }

  std::size_t size() const { return tiles_.size(); }
  /// Puts all places into the store.
  void rest() { tiles_.rest(); }

 private:
  using Place = RecordingPlace;
  using Tile = RecordingTile;

  // A point above the ground.
  struct Added {
    std::size_t i;
    unsigned octant;
    std::uint32_t place;  // its number
    VoxelKey cell;
    VoxelTile<Place>* places;
  };

  // Adds points of a scan. All places are found first, so that memory accesses overlap.
  void add_places(Span<Added> batch, PointsView points, Span<const PointLabel> verdicts,
                  const Pose& T_world_sensor, std::uint16_t epoch) {
    const Added* latest = nullptr;
    for (Added& added : batch) {
      const bool is_same = latest != nullptr && added.cell == latest->cell;
      added.place = is_same ? latest->place : added.places->add(added.cell);
      __builtin_prefetch(&added.places->values[added.place]);
      latest = &added;
    }
    for (const Added& added : batch) {
      Place& place = added.places->values[added.place];
      const std::size_t i = added.i;
      const bool is_removed = verdicts[i] == PointLabel::kDynamic;
      if (!is_removed) place.kept.add(epoch);
      // The first verdicts on points beyond the range of tests are little evidence.
      const float squared = points.x[i] * points.x[i] + points.y[i] * points.y[i];
      const bool is_near = squared <= static_cast<float>(kTestRange * kTestRange);
      if (is_near) place.first.add(is_removed, epoch);
      if (place.samples.has(added.octant)) continue;
      const Eigen::Vector3d point = world_point(points, i, T_world_sensor);
      place.samples.add(added.octant, (point - corner_of(added.cell)).array() / kWorldCell);
    }
  }

  // Adds the observation of the current epoch to the states of the places that it saw.
  void end_observation() {
    for (Place* const place : touched_) place->end_observation(epoch_);
    touched_.clear();
  }

  // Null: no scan brought a place there.
  const Place* find(VoxelKey cell) {
    const Tile* const tile = tiles_.find(tile_of(cell));
    return tile == nullptr ? nullptr : tile->places.find(cell);
  }
  // Null: there are less than 20 ground points in the column of a cell.
  const GroundColumn* find_ground(VoxelKey cell) {
    const Tile* const tile = tiles_.find(tile_of(cell));
    const GroundColumn* const found = tile == nullptr ? nullptr : &tile->ground[Tile::column(cell)];
    return found == nullptr || found->count < 20 ? nullptr : found;
  }

  PagedTiles<Tile> tiles_;
  VoxelTile<ChangedPlace> changed_;

  std::uint16_t epoch_ = 0;      // the current one
  std::vector<Place*> touched_;  // by it
};

}  // namespace dynains
