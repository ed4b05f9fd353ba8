// Writer of the contribution of one session to a map of many sessions.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "dynains/city/city.hpp"
#include "dynains/io/atomic_file.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/byte_store.hpp"
#include "dynains/recording/paged_tiles.hpp"
#include "dynains/recording/references.hpp"
#include "dynains/recording/world_cells.hpp"

namespace dynains {

class Folder;

/// Collects the static points of the scans of one session. The first point of each voxel is kept.
/// Tiles far from the sensor are moved to a store. All functions throw IoError if it fails.
class SessionPoints {
 public:
  /// `range`: m; farther points are not contributed. `store` outlives this. Throws ConfigError.
  SessionPoints(const SessionGrid& grid, double range, ByteStore& store)
      : grid_((grid.validate(), grid)), range_(range), tiles_(store, kBudget, grid.tile) {}

  /// Adds the static points of one scan (m, sensor frame). `verdicts`: final verdict by point.
  /// `labels`: label of the recording by point, or empty. `scan`: its number; ascending.
  void add(PointsView points, Span<const PointLabel> verdicts, Span<const std::uint32_t> labels,
           const Pose& T_world_sensor, std::uint32_t scan) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!is_static(verdicts[i])) continue;
      const float squared =
          points.x[i] * points.x[i] + points.y[i] * points.y[i] + points.z[i] * points.z[i];
      if (static_cast<double>(squared) > range_ * range_) continue;
      const Eigen::Vector3d position = world_point(points, i, T_world_sensor);
      const TileIndex index = tile_index(grid_, position);
      const Eigen::Vector3f p = (position - tile_corner(grid_, index)).cast<float>();
      const std::uint32_t label = labels.empty() ? 0 : labels[i];
      const std::uint32_t is_ground = verdicts[i] == PointLabel::kGround ? 1 : 0;
      const SessionPoint point = {p.x(), p.y(), p.z(), scan, label, is_ground};
      VoxelTile<SessionPoint>& tile = tiles_.at(index);
      const std::size_t count = tile.size();
      const std::uint32_t number = tile.add(session_voxel(grid_, point));
      if (number == count) tile.values[number] = point;
    }
    tiles_.free_far(T_world_sensor.translation(), range_);
  }

  /// Number of points.
  std::size_t size() const { return tiles_.size(); }

  /// Calls `visit(TileIndex, const std::vector<SessionPoint>&)` in the order of the indices.
  template <class Visitor>
  void for_each_tile(Visitor&& visit) {
    tiles_.for_each_index([&](const TileIndex& index) {
      visit(index, tiles_.find(index)->values);
      tiles_.free_far(tiles_.middle(index), 0.0);
    });
  }

 private:
  static constexpr std::size_t kBudget = std::size_t{64} << 20U;  // bytes

  SessionGrid grid_;
  double range_;  // m
  PagedTiles<VoxelTile<SessionPoint>> tiles_;
};

/// Takes the final verdicts of a session scan by scan, and adds the session to a city at once by
/// commit(). Until prepare(), an unnamed file in the folder of the city holds all data.
/// Errors of files throw IoError.
class SessionWriter {
 public:
  enum class Mode {
    kNew,     ///< the city has no session of this name
    kReplace  ///< the city has one; commit() replaces it atomically
  };

  /// `session`: the fields before SessionInfo::grid; the writer sets the others. Throws ConfigError
  /// for an invalid name, UsageError if the city has a session of this name or of this fingerprint,
  /// IoError.
  SessionWriter(const City& city, SessionInfo session, Mode mode = Mode::kNew);

  /// Adds one scan. `points`: m, sensor frame. `verdicts`: final verdict by point. `labels`: label
  /// of the recording by point, or empty. `T_session_sensor` is moved by SessionInfo::alignment.
  /// `scan`: its number; ascending.
  void add(PointsView points, Span<const PointLabel> verdicts, Span<const std::uint32_t> labels,
           const Pose& T_session_sensor, std::uint32_t scan);

  /// Writes the session to the disk, so that nothing but its name is left to commit(). No scan can
  /// be added then, and the city is locked until the end of this object. Throws IoError, and
  /// UsageError as the constructor.
  void prepare();

  /// prepare(), and puts the session in place, on the disk. Throws IoError or UsageError; the city
  /// is then unchanged.
  void commit();

 private:
  void check();

  City city_;
  SessionInfo session_;
  Mode mode_;
  ByteStore store_;
  SessionPoints points_;
  RecordingReferences references_;
  std::vector<std::uint8_t> bytes_;
  std::shared_ptr<Folder> locked_;
  std::unique_ptr<AtomicFile> file_;
};

}  // namespace dynains
