// The map of a city: which points of which session stand, tile by tile.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "dynains/city/city.hpp"
#include "dynains/errors.hpp"

namespace dynains {
namespace {

/// Points that stand in one state of a tile and whose voxels are empty in the other one.
class Candidates {
 public:
  Candidates(const SessionGrid& grid, const TileHistory& history)
      : grid_(grid), history_(history) {}

  void add(std::size_t session, std::size_t i) {
    points_.values[points_.add(block(session, i))].push_back({session, i});
  }
  /// Adds a point that stands in both states.
  void add_standing(std::size_t session, std::size_t i) { standing_.insert(block(session, i)); }

  /// The points of clusters that are objects: higher than 0.4 m, seen standing by their own session
  /// all the time, and not a part of something that stands in both states.
  std::vector<CityPoint> objects() const {
    std::vector<CityPoint> result;
    ComponentSearch().for_each(
        points_.keys, points_.numbers, [&](const std::vector<std::uint32_t>& members) {
          if (!is_object(members)) return;
          for (const std::uint32_t block : members) {
            for (const auto& [session, i] : points_.values[block]) {
              result.push_back({static_cast<std::uint32_t>(session), history_.points(session)[i]});
            }
          }
        });
    return result;
  }

 private:
  VoxelKey block(std::size_t session, std::size_t i) const {
    return block_of(session_voxel(grid_, history_.points(session)[i]));
  }

  bool is_object(const std::vector<std::uint32_t>& members) const {
    Eigen::AlignedBox3f box;
    float points = 0.0F, hits = 0.0F, passed = 0.0F, contacts = 0.0F;
    for (const std::uint32_t block : members) {
      bool touches = false;
      for_each_touching(points_.keys[block], [&](VoxelKey key) {
        touches = touches || standing_.find(key) != kNoIndex;
      });
      contacts += touches ? 1.0F : 0.0F;
      for (const auto& [session, i] : points_.values[block]) {
        const SessionPoint& point = history_.points(session)[i];
        box.extend(Eigen::Vector3f(point.x, point.y, point.z));
        points += 1.0F;
        hits += static_cast<float>(history_.own_hits(session, i));
        passed += history_.own_beams_passed(session, i) ? 1.0F : 0.0F;
      }
    }
    // An object is at least 40 cm high, three references of its session hit it in the mean, beams
    // pass 5 % of its points at most, and at most 70 % of its blocks touch unchanged objects.
    return members.size() >= 8 && box.sizes().z() > 0.4F && hits >= 3.0F * points &&
           passed <= 0.05F * points && contacts <= 0.7F * static_cast<float>(members.size());
  }

  const SessionGrid& grid_;
  const TileHistory& history_;
  VoxelHashTable<> standing_;                                           // blocks
  VoxelTile<std::vector<std::pair<std::size_t, std::size_t>>> points_;  // by block
};

}  // namespace

CityChanges find_changes(const SessionGrid& grid, const TileHistory& history, std::uint32_t a,
                         std::uint32_t b) {
  const auto voxel = [&](std::size_t session, std::size_t i) {
    return session_voxel(grid, history.points(session)[i]);
  };
  const auto voxels_after = [&](std::uint32_t last) {
    VoxelHashTable<> voxels;
    history.for_each_standing(
        last, [&](std::size_t session, std::size_t i) { voxels.insert(voxel(session, i)); });
    return voxels;
  };
  const VoxelHashTable<> before = voxels_after(a), after = voxels_after(b);
  Candidates removed(grid, history), added(grid, history);
  history.for_each_standing(a, [&](std::size_t session, std::size_t i) {
    if (history.points(session)[i].is_ground != 0) return;
    if (after.find(voxel(session, i)) == kNoIndex) removed.add(session, i);
  });
  history.for_each_standing(b, [&](std::size_t session, std::size_t i) {
    if (history.points(session)[i].is_ground != 0) return;
    if (before.find(voxel(session, i)) != kNoIndex) {
      removed.add_standing(session, i);
      added.add_standing(session, i);
    } else if (history.was_free(session, i)) {
      added.add(session, i);
    }
  });
  return {removed.objects(), added.objects()};
}

std::uint32_t City::number_of(const std::string& session) const {
  const auto found = std::find_if(sessions_.begin(), sessions_.end(),
                                  [&](const SessionInfo& info) { return info.name == session; });
  if (found == sessions_.end()) {
    throw ConfigError(folder_.string() + ": has no session \"" + session + '"');
  }
  return static_cast<std::uint32_t>(found - sessions_.begin());
}

std::vector<TileIndex> City::tiles() const {
  std::set<TileIndex> tiles;
  for (const SessionInfo& session : sessions_) {
    for (const auto& tile : session.tiles) tiles.insert(tile.first);
  }
  return {tiles.begin(), tiles.end()};
}

TileHistory City::history(const TileIndex& tile, std::uint32_t last) const {
  TileHistory history(grid_);
  const std::size_t count = std::min<std::size_t>(sessions_.size(), std::size_t{last} + 1);
  for (std::size_t i = 0; i < count; ++i) {
    history.add_session(read_tile(sessions_[i], tile));
  }
  for (std::size_t i = 0; i < count; ++i) {
    revise(history, tile, sessions_[i]);
    history.end_session();
  }
  return history;
}

CityChanges City::changes(const TileIndex& tile, std::uint32_t a, std::uint32_t b) const {
  if (a >= b) throw ConfigError("changes of a map: expected an earlier and a later session");
  return find_changes(grid_, history(tile, b), a, b);
}

void City::revise(TileHistory& history, const TileIndex& tile, const SessionInfo& session) const {
  detail::Visibility visibility;
  RecordingReference reference;
  const double edge = grid_.tile;
  const Eigen::Vector3d corner = tile_corner(grid_, tile);
  const Eigen::Vector3d middle = corner + Eigen::Vector3d(0.5 * edge, 0.5 * edge, 0.0);
  // Beyond this distance, no point of the tile is in range.
  const double reach = kTestRange + std::sqrt(0.5) * edge;
  for (const SessionReference& which : session.references) {
    if ((which.sensor - middle).head<2>().norm() > reach) continue;
    read_reference(session, which, reference);
    history.revise(
        which.sensor - corner,
        [&](const auto& points, std::size_t count, const auto& origin) -> const auto& {
          return test_visibility(reference, session.evidence, points, count, corner + origin,
                                 visibility);
        });
  }
}

}  // namespace dynains
