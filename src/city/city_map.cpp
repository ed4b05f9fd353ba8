#include "dynains/city/city_map.hpp"

#include <algorithm>
#include <cmath>

#include "dynains/errors.hpp"

namespace dynains {
namespace {

/// Points that may be changes, with their sessions.
struct Candidates {
  std::vector<ChangedPoint> points;
  std::vector<std::uint32_t> sessions;

  void add(std::size_t session, const ChangedPoint& point) {
    points.push_back(point);
    sessions.push_back(static_cast<std::uint32_t>(session));
  }
  void keep(const std::vector<bool>& is_kept) {
    std::size_t size = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!is_kept[i]) continue;
      points[size] = points[i];
      sessions[size++] = sessions[i];
    }
    points.resize(size);
    sessions.resize(size);
  }
  std::vector<CityPoint> selected(const ChangeClusters& clusters) const {
    const std::vector<bool> is_selected = clusters.select(points);
    std::vector<CityPoint> result;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (is_selected[i]) result.push_back({sessions[i], points[i].point});
    }
    return result;
  }
};

}  // namespace

CityMap::CityMap(const City& city) : city_(city), sessions_(city.sessions()) {
  references_.reserve(sessions_.size());
  for (const SessionInfo& session : sessions_) references_.emplace_back(city_, session);
}

std::uint32_t CityMap::number_of(const std::string& session) const {
  const auto found = std::find_if(sessions_.begin(), sessions_.end(),
                                  [&](const SessionInfo& info) { return info.name == session; });
  if (found == sessions_.end()) {
    throw ConfigError(city_.folder().string() + ": has no session \"" + session + '"');
  }
  return static_cast<std::uint32_t>(found - sessions_.begin());
}

std::vector<TileIndex> CityMap::tiles() const {
  std::set<TileIndex> tiles;
  for (const SessionInfo& session : sessions_) {
    for (const auto& tile : session.tiles) tiles.insert(tile.first);
  }
  return {tiles.begin(), tiles.end()};
}

TileHistory CityMap::history(const TileIndex& tile, std::uint32_t last) const {
  TileHistory history(city_.grid());
  const std::size_t count = std::min<std::size_t>(sessions_.size(), std::size_t{last} + 1);
  for (std::size_t i = 0; i < count; ++i) {
    history.add_session(city_.read_tile(sessions_[i], tile));
  }
  for (std::size_t i = 0; i < count; ++i) {
    revise(history, tile, i);
    history.end_session();
  }
  return history;
}

CityChanges CityMap::changes(const TileIndex& tile, const TileHistory& history, std::uint32_t a,
                             std::uint32_t b) const {
  if (a >= b) throw ConfigError("changes of a map: expected an earlier and a later session");
  const SessionGrid& grid = city_.grid();
  ChangeClusters clusters(grid);
  VoxelHashTable<> before, after;
  history.for_each_standing(a, [&](std::size_t session, std::size_t i) {
    before.insert(session_voxel(grid, history.points(session)[i]));
  });
  history.for_each_standing(b, [&](std::size_t session, std::size_t i) {
    after.insert(session_voxel(grid, history.points(session)[i]));
  });
  Candidates removed, added;
  const auto sort = [&](std::size_t session, std::size_t i, const VoxelHashTable<>& other,
                        Candidates& candidates) {
    const SessionPoint& point = history.points(session)[i];
    if (!history.is_above_ground(point)) return;
    if (other.find(session_voxel(grid, point)) != VoxelHashTable<>::kNone) {
      clusters.add_standing(point);
    } else {
      candidates.add(session,
                     {point, history.own_hits(session, i), history.own_beams_passed(session, i)});
    }
  };
  history.for_each_standing(a, [&](std::size_t session, std::size_t i) {
    if (!history.stands(session, i, b)) sort(session, i, after, removed);
  });
  history.for_each_standing(
      b, [&](std::size_t session, std::size_t i) { sort(session, i, before, added); });
  // A point was added if beams of a session before its own passed through its place. Places that
  // none of them saw are no changes.
  added.keep(free_before(tile, added.points, added.sessions));

  CityChanges changes;
  changes.removed = removed.selected(clusters);
  changes.added = added.selected(clusters);
  return changes;
}

std::vector<bool> CityMap::free_before(const TileIndex& tile,
                                       const std::vector<ChangedPoint>& points,
                                       const std::vector<std::uint32_t>& sessions) const {
  if (points.empty()) return {};
  const std::uint32_t end = *std::max_element(sessions.begin(), sessions.end());
  // The points are session 0 here, and session i of the map is session i + 1.
  TileHistory reversed(city_.grid());
  std::vector<SessionPoint> places;
  places.reserve(points.size());
  for (const ChangedPoint& changed : points) places.push_back(changed.point);
  reversed.add_session(std::move(places));
  for (std::uint32_t session = 0; session < end; ++session) reversed.add_session({});
  reversed.end_session();
  for (std::uint32_t session = 0; session < end; ++session) {
    revise(reversed, tile, session);
    reversed.end_session();
  }
  std::vector<bool> is_free;
  for (std::size_t i = 0; i < points.size(); ++i) {
    is_free.push_back(!reversed.stands(0, i, sessions[i]));
  }
  return is_free;
}

void CityMap::revise(TileHistory& history, const TileIndex& tile, std::size_t session) const {
  ReferenceTest test{FreeSpaceConfig()};
  RecordingReference reference;
  const Eigen::Vector3d corner = tile_corner(city_.grid(), tile);
  const Eigen::Vector3d middle =
      corner + Eigen::Vector3d(0.5 * city_.grid().tile, 0.5 * city_.grid().tile, 0.0);
  // Beyond this distance, no point of the tile is in range.
  const double reach = TileHistory::kRange + std::sqrt(0.5) * city_.grid().tile;
  for (const SessionReferenceReader::Entry& entry : references_[session].entries()) {
    if ((entry.sensor - middle).head<2>().norm() > reach) continue;
    references_[session].read(entry, reference);
    const Pose T_world_points(Eigen::Translation3d(entry.sensor));
    history.revise(entry.scan, entry.sensor - corner,
                   [&](const PointBuffer& points, std::size_t count) -> const detail::Visibility& {
                     return test(reference, points, count, T_world_points);
                   });
  }
}

}  // namespace dynains
