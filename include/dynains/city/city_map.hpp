// The map of a city: which points of which session stand, tile by tile.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "dynains/city/change_clusters.hpp"
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

/// Reads a city as a map. The result is a function of the set of sessions. Memory: one tile of all
/// sessions and one range image.
class CityMap {
 public:
  /// Throws ConfigError, IoError.
  explicit CityMap(const City& city);

  const std::vector<SessionInfo>& sessions() const { return sessions_; }
  /// Number of a session in the order of time. Throws ConfigError if there is none.
  std::uint32_t number_of(const std::string& session) const;

  /// All tiles that any session has points in, sorted.
  std::vector<TileIndex> tiles() const;

  /// The history of one tile over sessions 0 to `last`. Throws IoError.
  TileHistory history(const TileIndex& tile, std::uint32_t last = TileHistory::kNever) const;

  /// Objects larger than 0.5 m that came or left from the map after session `a` to the map after
  /// session `b`, see ChangeClusters. Places that only one of both maps has seen are no changes.
  /// Throws ConfigError unless `a` is before `b`; IoError.
  CityChanges changes(const TileIndex& tile, std::uint32_t a, std::uint32_t b) const {
    return changes(tile, history(tile, b), a, b);
  }
  /// With the history of the tile over sessions 0 to `b`, or more.
  CityChanges changes(const TileIndex& tile, const TileHistory& history, std::uint32_t a,
                      std::uint32_t b) const;

  /// World position of a point of a tile, m.
  Eigen::Vector3d position(const TileIndex& tile, const SessionPoint& point) const {
    return tile_corner(city_.grid(), tile) + Eigen::Vector3d(static_cast<double>(point.x),
                                                             static_cast<double>(point.y),
                                                             static_cast<double>(point.z));
  }

 private:
  // Whether beams of sessions before its own passed through the place of a point. `sessions`:
  // session of each point.
  std::vector<bool> free_before(const TileIndex& tile, const std::vector<ChangedPoint>& points,
                                const std::vector<std::uint32_t>& sessions) const;
  void revise(TileHistory& history, const TileIndex& tile, std::size_t session) const;

  City city_;
  std::vector<SessionInfo> sessions_;
  std::vector<SessionReferenceReader> references_;  // by session
};

}  // namespace dynains
