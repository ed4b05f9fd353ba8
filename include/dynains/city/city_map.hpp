// The map of a city: which points of which session stand, tile by tile.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "dynains/city/city.hpp"
#include "dynains/city/tile_history.hpp"

namespace dynains {

/// One point of the map of a city.
struct CityPoint {
  std::uint32_t session;  ///< number of the session that measured it
  SessionPoint point;
};

/// Changes of a tile from the map after one session to the map after a later one.
struct CityChanges {
  std::vector<CityPoint> removed;  ///< points that beams of a later session passed through
  std::vector<CityPoint> added;    ///< new points whose place beams of earlier sessions passed
};

/// Changes of a tile from the map after session `a` to the map after session `b`, whose history has
/// sessions 0 to `b`, or more: clusters of points in touching blocks that are objects, see
/// docs/scale.md. Places that only one of both maps has seen are no changes.
CityChanges find_changes(const SessionGrid& grid, const TileHistory& history, std::uint32_t a,
                         std::uint32_t b);

/// Reads a city as a map. The result is a function of the set of sessions. Memory: one tile of all
/// sessions and one range image.
class CityMap {
 public:
  /// Throws IoError.
  explicit CityMap(const City& city) : city_(city), sessions_(city.sessions()) {}

  const std::vector<SessionInfo>& sessions() const { return sessions_; }
  /// Number of a session in the order of time. Throws ConfigError if there is none.
  std::uint32_t number_of(const std::string& session) const;

  /// All tiles that any session has points in, sorted.
  std::vector<TileIndex> tiles() const;

  /// The history of one tile over sessions 0 to `last`. Throws IoError.
  TileHistory history(const TileIndex& tile, std::uint32_t last = TileHistory::kNever) const;

  /// find_changes(). Throws ConfigError unless `a` is before `b`; IoError.
  CityChanges changes(const TileIndex& tile, std::uint32_t a, std::uint32_t b) const;

  /// World position of a point of a tile, m.
  Eigen::Vector3d position(const TileIndex& tile, const SessionPoint& point) const {
    return position_of(city_.grid(), tile, point);
  }

 private:
  void revise(TileHistory& history, const TileIndex& tile, const SessionInfo& session) const;

  City city_;
  std::vector<SessionInfo> sessions_;
};

}  // namespace dynains
