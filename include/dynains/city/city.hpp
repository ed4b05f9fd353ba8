// A map of many sessions in a folder: the contributions of all sessions.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "dynains/city/session.hpp"
#include "dynains/recording/references.hpp"

namespace dynains {

/// A folder CITY with one file NAME.session for each session, which is written once and never
/// changed (SessionWriter). The map is a function of the sessions (CityMap); nothing else is
/// stored. All members throw IoError with path and position.
class City {
 public:
  /// Opens a city that has sessions.
  explicit City(const std::filesystem::path& folder);

  /// Opens a city, or makes one with this grid if `folder` is missing or empty. Throws ConfigError
  /// if `grid` is invalid, or if the city has another grid.
  static City open_or_make(const std::filesystem::path& folder, const SessionGrid& grid);

  const std::filesystem::path& folder() const { return folder_; }
  const SessionGrid& grid() const { return grid_; }

  /// All sessions, in the order of their time. Links are none.
  std::vector<SessionInfo> sessions() const;
  std::filesystem::path session_file(const std::string& name) const {
    return folder_ / (name + ".session");
  }

  /// Points of one tile of a session; empty if the session has none there.
  std::vector<SessionPoint> read_tile(const SessionInfo& session, const TileIndex& tile) const;
  /// Reads one of the references of a session into `reference`, whose memory is used again.
  void read_reference(const SessionInfo& session, const SessionReference& which,
                      RecordingReference& reference) const;

  /// Removes one session: the map is as if it had never come.
  void drop(const std::string& name);

  /// Reads everything. Returns one message, with path and position, for each defect.
  std::vector<std::string> check() const;

 private:
  City(std::filesystem::path folder, const SessionGrid& grid)
      : folder_(std::move(folder)), grid_(grid) {}

  std::vector<std::string> names() const;

  std::filesystem::path folder_;
  SessionGrid grid_;
};

}  // namespace dynains
