#include "dynains/io/city_map.hpp"

#include <algorithm>
#include <cmath>

#include "dynains/errors.hpp"

namespace dynains {

CityMap::CityMap(const City& city, const MapRevisionConfig& config)
    : city_(city), config_((config.validate(), config)), sessions_(city.sessions()) {
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
  TileHistory history(city_.grid(), config_);
  for (std::size_t i = 0; i < sessions_.size() && i <= last; ++i) {
    revise(history, tile, i);
    history.add_session(city_.read_tile(sessions_[i], tile));
  }
  return history;
}

void CityMap::revise(TileHistory& history, const TileIndex& tile, std::size_t session) const {
  ReferenceTest test{FreeSpaceConfig()};
  SessionReference reference;
  const Eigen::Vector3d corner = tile_corner(city_.grid(), tile);
  const Eigen::Vector3d middle =
      corner + Eigen::Vector3d(0.5 * city_.grid().tile, 0.5 * city_.grid().tile, 0.0);
  // Beyond this distance, no point of the tile is in range.
  const double reach = config_.revision_range + std::sqrt(0.5) * city_.grid().tile;
  for (const SessionReferenceReader::Entry& entry : references_[session].entries()) {
    if ((entry.sensor - middle).head<2>().norm() > reach) continue;
    references_[session].read(entry, reference);
    const Eigen::Isometry3d T_world_points(Eigen::Translation3d(entry.sensor));
    history.revise(entry.scan, entry.sensor - corner,
                   [&](const PointBuffer& points, std::size_t count) -> const detail::Visibility& {
                     return test(reference, points, count, T_world_points);
                   });
  }
}

}  // namespace dynains
