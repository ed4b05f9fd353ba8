// A map of many sessions in a folder: the contributions of all sessions.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "dynains/city/session_alignment.hpp"
#include "dynains/city/session_points.hpp"
#include "dynains/recording/references.hpp"

namespace dynains {

/// A session of the map: the content of its session.json.
struct SessionInfo {
  std::string name;         ///< of its folder: letters, digits, '.', '_', '-'; first no '.'
  double begin = 0.0;       ///< s; sessions are ordered by begin, then by name
  std::string recording;    ///< as the user named it
  std::string fingerprint;  ///< of poses and times; empty: unknown
  std::string config;       ///< JSON of the configuration that gave the verdicts; may be empty
  std::uint64_t scans = 0;
  std::uint64_t points = 0;                           ///< static points, one per voxel
  std::uint64_t references = 0;                       ///< reference scans
  std::map<TileIndex, std::uint64_t> tiles;           ///< number of points by tile
  Eigen::Vector3d lowest = Eigen::Vector3d::Zero();   ///< m, world frame, of its points
  Eigen::Vector3d highest = Eigen::Vector3d::Zero();  ///< m, world frame, of its points
  /// How its poses were moved into the frame of the map; empty: they were taken as they are.
  std::optional<SessionAlignment> alignment;
};

/// Whether `name` can name a session.
bool is_session_name(const std::string& name);

/// A folder CITY with city.json, which holds the grid, and one folder for each session. A session
/// is written once and never changed (SessionWriter). The map is a function of the sessions
/// (CityMap); nothing else is stored. All members throw IoError with path and position.
class City {
 public:
  /// Opens an existing city.
  explicit City(const std::filesystem::path& folder);

  /// Opens a city, or makes one with this grid if `folder` is missing or empty. Throws ConfigError
  /// if `grid` is invalid, or if the city has another grid.
  static City open_or_make(const std::filesystem::path& folder, const SessionGrid& grid);

  const std::filesystem::path& folder() const { return folder_; }
  const SessionGrid& grid() const { return grid_; }

  /// All sessions, in the order of their time.
  std::vector<SessionInfo> sessions() const;
  std::filesystem::path session_folder(const std::string& name) const { return folder_ / name; }

  /// Points of one tile of a session; empty if the session has none there.
  std::vector<SessionPoint> read_tile(const SessionInfo& session, const TileIndex& tile) const;

  /// Removes the folder of one session. Throws IoError before any change if there is no such
  /// session or if its folder holds files that are not part of the session.
  void drop(const std::string& name);

  /// Reads everything. Returns one message, with path and position, for each defect.
  std::vector<std::string> check() const;

 private:
  City(std::filesystem::path folder, const SessionGrid& grid)
      : folder_(std::move(folder)), grid_(grid) {}

  std::filesystem::path folder_;
  SessionGrid grid_;
};

/// Reads the reference scans of a session. All members throw IoError with path and byte.
class SessionReferenceReader {
 public:
  SessionReferenceReader(const City& city, const SessionInfo& session);

  struct Entry {
    std::uint32_t scan;
    Eigen::Vector3d sensor;  ///< m, world frame
    std::uint64_t offset;    ///< of its record in the file
  };
  /// All references, in the order of their scans.
  const std::vector<Entry>& entries() const { return entries_; }
  /// Reads one reference into `reference`, whose memory is used again.
  void read(const Entry& entry, RecordingReference& reference) const;

 private:
  std::filesystem::path path_;
  RangeImageGrid grid_;
  std::vector<Entry> entries_;
};

}  // namespace dynains
