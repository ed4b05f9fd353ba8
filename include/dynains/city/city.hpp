// A map of many sessions in a folder: the contributions of all sessions.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "dynains/city/session.hpp"
#include "dynains/city/tile_history.hpp"
#include "dynains/recording/references.hpp"

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
/// docs/scale.md. Space that only one of the two maps has seen is unchanged.
CityChanges find_changes(const SessionGrid& grid, const TileHistory& history, std::uint32_t a,
                         std::uint32_t b);

/// A folder CITY with one file NAME.session for each session, which is written once and never
/// changed (SessionWriter). The map is a function of the set of sessions; nothing else is stored.
/// Memory: one tile of all sessions and one range image. All members throw IoError with path and
/// position.
class City {
 public:
  /// Opens a city that has sessions.
  explicit City(const std::filesystem::path& folder);

  /// A city whose sessions are not read, for check() and drop(): some may be damaged.
  static City unread(const std::filesystem::path& folder) { return City(folder, SessionGrid()); }

  /// Opens a city, or makes one with this grid if `folder` is missing or empty. Throws ConfigError
  /// if `grid` is invalid, or if the city has another grid.
  static City open_or_make(const std::filesystem::path& folder, const SessionGrid& grid);

  /// The folder CITY, as given.
  const std::filesystem::path& folder() const { return folder_; }
  /// Voxels and tiles, equal for all sessions.
  const SessionGrid& grid() const { return grid_; }
  /// Path of the file of a session, whether or not it exists.
  std::filesystem::path session_file(const std::string& name) const {
    return folder_ / (name + ".session");
  }

  /// Lists the sessions in the folder. Symbolic links are ignored.
  void reload();
  /// All sessions as of the latest reload(), in the order of their time.
  const std::vector<SessionInfo>& sessions() const { return sessions_; }
  /// Number of a session in the order of time. Throws ConfigError if there is none.
  std::uint32_t number_of(const std::string& session) const;

  /// Points of one tile of a session; empty if the session has none there.
  std::vector<SessionPoint> read_tile(const SessionInfo& session, const TileIndex& tile) const;
  /// Reads one of the references of a session into `reference`, whose memory is reused.
  void read_reference(const SessionInfo& session, const SessionReference& which,
                      RecordingReference& reference) const;

  /// All tiles that any session has points in, sorted.
  std::vector<TileIndex> tiles() const;
  /// The history of one tile over sessions 0 to `last`.
  TileHistory history(const TileIndex& tile, std::uint32_t last = TileHistory::kNever) const;
  /// find_changes(). Throws ConfigError unless `a` is before `b`.
  CityChanges changes(const TileIndex& tile, std::uint32_t a, std::uint32_t b) const;

  /// Removes one session. The map is then the same, byte by byte, as without it.
  void drop(const std::string& name);

  /// Reads everything. Returns one message, with path and position, for each defect, and for each
  /// session of the same scans, poses and times as another.
  std::vector<std::string> check() const;

 private:
  City(std::filesystem::path folder, const SessionGrid& grid)
      : folder_(std::move(folder)), grid_(grid) {}

  std::vector<std::string> names() const;
  void revise(TileHistory& history, const TileIndex& tile, const SessionInfo& session) const;

  std::filesystem::path folder_;
  SessionGrid grid_;
  std::vector<SessionInfo> sessions_;
};

}  // namespace dynains
