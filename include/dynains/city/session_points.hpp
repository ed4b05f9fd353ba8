// Static points of one session, by tile: its contribution to a map of many sessions.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "dynains/city/filled_voxels.hpp"
#include "dynains/city/session_grid.hpp"
#include "dynains/city/session_voxel_locator.hpp"
#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/simd/bits.hpp"

namespace dynains {

struct SessionPointsConfig {
  double contribution_range = 60.0;  ///< m

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(Parameter{"contribution_range", self.contribution_range, closed(5, 300), "m",
                      "points at a larger distance from the sensor are not contributed"});
  }

  /// Throws ConfigError.
  void validate() const { validate_parameters("SessionPoints", *this); }
};

/// Collects the static points of the scans of one session. The first point of each voxel is kept.
/// The result depends on the scans of this session only. Tiles behind the sensor can be taken out
/// (release_far) and put back. Memory: 24 bytes per kept point, with
/// the margin of a growing vector, and those of FilledVoxels.
class SessionPoints {
 public:
  /// Throws ConfigError.
  explicit SessionPoints(const SessionGrid& grid, const SessionPointsConfig& config = {})
      : grid_((grid.validate(), grid)),
        config_((config.validate(), config)),
        locator_(grid, config.contribution_range) {}

  const SessionGrid& grid() const { return grid_; }

  /// Adds the static points of one scan (m, sensor frame). `verdicts`: final verdict by point.
  /// `labels`: label of the recording by point, or empty. `scan`: its number; ascending.
  void add(PointsView points, Span<const PointLabel> verdicts, Span<const std::uint32_t> labels,
           const Pose& T_world_sensor, std::uint32_t scan) {
    locator_.begin_scan(T_world_sensor);
    around_.assign(locator_.tile_count(), nullptr);
    const Scan all = {points, verdicts, labels, T_world_sensor, scan};
    for (std::size_t begin = 0; begin < points.size(); begin += SessionVoxelLocator::kMost) {
      const std::size_t size = std::min(SessionVoxelLocator::kMost, points.size() - begin);
      locator_.locate(points.subview(begin, size), voxels_);
      find_candidates(verdicts.subspan(begin, size));
      for (const std::uint16_t at : candidates_) prefetch(at);
      for (const std::uint16_t at : candidates_) add_point(all, begin + at, at);
    }
  }

  /// Number of points in memory.
  std::size_t size() const { return size_; }

  /// Takes out the tiles that are beyond the contribution range around `sensor` (m, world frame) by
  /// more than a tile. Calls `visit(TileIndex, const std::vector<SessionPoint>&)` for each.
  template <class Visitor>
  void release_far(const Eigen::Vector3d& sensor, Visitor&& visit) {
    for (auto tile = tiles_.begin(); tile != tiles_.end();) {
      if (distance(tile->first, sensor) <= config_.contribution_range + grid_.tile) {
        ++tile;
        continue;
      }
      visit(tile->first, tile->second.points);
      size_ -= tile->second.points.size();
      tile = tiles_.erase(tile);
    }
  }
  /// Whether a scan at `sensor` (m, world frame) may add points to a tile.
  bool reaches(const Eigen::Vector3d& sensor, const TileIndex& tile) const {
    return distance(tile, sensor) <= config_.contribution_range + kAhead * grid_.tile;
  }
  /// Puts back a tile that was taken out, before a scan that reaches it.
  void restore(const TileIndex& index, std::vector<SessionPoint> points) {
    Tile& tile = tiles_[index];
    for (const SessionPoint& point : points) tile.filled.add(session_voxel_index(grid_, point));
    size_ += points.size();
    tile.points = std::move(points);
  }

  /// Calls `visit(TileIndex, const std::vector<SessionPoint>&)` in the order of the indices.
  template <class Visitor>
  void for_each_tile(Visitor&& visit) const {
    for (const auto& [index, tile] : tiles_) visit(index, tile.points);
  }

 private:
  static constexpr double kAhead = 0.01;  // tiles: more than the rounding of positions

  // Distance of a position from a tile along the axis where it is larger, m.
  double distance(const TileIndex& tile, const Eigen::Vector3d& position) const {
    const Eigen::Vector2d middle =
        tile_corner(grid_, tile).head<2>() + Eigen::Vector2d::Constant(0.5 * grid_.tile);
    return (position.head<2>() - middle).cwiseAbs().maxCoeff() - 0.5 * grid_.tile;
  }

  struct Tile {
    std::vector<SessionPoint> points;
    FilledVoxels filled;
  };

  struct Scan {
    PointsView points;
    Span<const PointLabel> verdicts;
    Span<const std::uint32_t> labels;
    const Pose& T_world_sensor;
    std::uint32_t number;
  };

  // Finds the static points that may be the first ones of their voxels.
  void find_candidates(Span<const PointLabel> verdicts) {
    candidates_.clear();
    std::array<std::uint8_t, SessionVoxelLocator::kMost> is_candidate = {};
    for (std::size_t i = 0; i < verdicts.size(); ++i) is_candidate[i] = is_static(verdicts[i]);
    for (std::size_t first = 0; first < verdicts.size(); first += 64) {
      const std::uint64_t statics = detail::nonzero_bytes(&is_candidate[first]);
      // A static point in the voxel of the static point before it is not the first one there.
      const std::uint64_t changes = voxels_.changes[first / 64] | ~(statics << 1U);
      detail::for_each_bit(statics & changes, [&](std::size_t bit) {
        candidates_.push_back(static_cast<std::uint16_t>(first + bit));
      });
    }
  }

  void prefetch(std::size_t at) const {
    if (voxels_.tile[at] < 0) return;
    const Tile* const tile = around_[static_cast<std::size_t>(voxels_.tile[at])];
    if (tile != nullptr) tile->filled.prefetch(voxels_.index(at));
  }

  // Adds static point i of a scan. `at`: its number in voxels_.
  void add_point(const Scan& scan, std::size_t i, std::size_t at) {
    const std::int32_t number = voxels_.tile[at];
    if (number == SessionVoxelLocator::kOutOfRange) return;
    const bool is_sure = number != SessionVoxelLocator::kUnsure;
    Tile** const tile = is_sure ? &around_[static_cast<std::size_t>(number)] : nullptr;
    // Most voxels have a point already.
    if (tile != nullptr && *tile != nullptr && (*tile)->filled.has(voxels_.index(at))) return;
    const Eigen::Vector3d local(static_cast<double>(scan.points.x[i]),
                                static_cast<double>(scan.points.y[i]),
                                static_cast<double>(scan.points.z[i]));
    if (local.squaredNorm() > config_.contribution_range * config_.contribution_range) return;
    Tile& own = add_point(scan.T_world_sensor * local,
                          {0.0F, 0.0F, 0.0F, scan.number, scan.labels.empty() ? 0 : scan.labels[i],
                           scan.verdicts[i] == PointLabel::kGround});
    if (tile != nullptr) *tile = &own;
  }

  // `point`: all but the coordinates. Returns its tile.
  Tile& add_point(const Eigen::Vector3d& position, SessionPoint point) {
    const TileIndex index = tile_index(grid_, position);
    Tile& tile = tiles_[index];
    const Eigen::Vector3d relative = position - tile_corner(grid_, index);
    point.x = static_cast<float>(relative.x());
    point.y = static_cast<float>(relative.y());
    point.z = static_cast<float>(relative.z());
    if (tile.filled.add(session_voxel_index(grid_, point))) {
      tile.points.push_back(point);
      ++size_;
    }
    return tile;
  }

  SessionGrid grid_;
  SessionPointsConfig config_;
  SessionVoxelLocator locator_;
  SessionVoxelLocator::Voxels voxels_;
  std::map<TileIndex, Tile> tiles_;        // its elements do not move
  std::vector<std::uint16_t> candidates_;  // in voxels_
  std::vector<Tile*> around_;              // by number of the tile in locator_; null: unknown
  std::size_t size_ = 0;
};

}  // namespace dynains
