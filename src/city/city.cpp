#include "dynains/city/city.hpp"

#include <algorithm>
#include <cctype>
#include <system_error>
#include <utility>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"
#include "dynains/io/folder_lock.hpp"
#include "io/failure.hpp"
#include "session_files.hpp"
#include "session_folder.hpp"
#include "session_json.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

/// Names of the session folders of a city, sorted. A link is no session.
std::vector<std::string> session_names(const fs::path& city) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(city, error), end; !error && entry != end;
       entry.increment(error)) {
    std::string name = entry->path().filename().string();
    const bool is_folder = entry->is_directory() && !entry->is_symlink();
    if (is_session_name(name) && is_folder) names.push_back(std::move(name));
  }
  if (error) fail_by_system(city, "cannot be read", error.value());
  std::sort(names.begin(), names.end());
  return names;
}

/// Links that have the place of a session.
std::vector<fs::path> linked_sessions(const fs::path& city) {
  std::vector<fs::path> links;
  for (const auto& entry : fs::directory_iterator(city)) {
    const bool is_link = entry.is_symlink() && entry.is_directory();
    if (is_link && is_session_name(entry.path().filename().string())) links.push_back(entry.path());
  }
  std::sort(links.begin(), links.end());
  return links;
}

/// Throws unless session.json tells the number of points of its tiles.
void check_count(const fs::path& file, const SessionInfo& session) {
  std::uint64_t points = 0;
  for (const auto& tile : session.tiles) points += tile.second;
  if (points == session.points) return;
  fail(file, "/points: expected " + std::to_string(points) + ", the sum over /tiles");
}

/// Throws unless every point of a tile lies within the bounds that session.json tells.
void check_bounds(const fs::path& file, const SessionGrid& grid, const SessionInfo& session,
                  const TileIndex& tile, const std::vector<SessionPoint>& points) {
  const Eigen::Vector3d corner = tile_corner(grid, tile);
  for (const SessionPoint& point : points) {
    const Eigen::Vector3d position =
        corner + Eigen::Vector3f(point.x, point.y, point.z).cast<double>();
    const bool is_within = (position.array() >= session.lowest.array()).all() &&
                           (position.array() <= session.highest.array()).all();
    if (!is_within) fail(file, "expected points between lowest and highest of session.json");
  }
}

std::string number_text(double value) {
  std::string text = std::to_string(value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

void refuse_other_grid(const fs::path& city, const SessionGrid& its, const SessionGrid& asked) {
  const auto refuse = [&](const char* field, double is, double is_asked) {
    if (is == is_asked) return;
    throw ConfigError(city.string() + ": its sessions have " + field + " = " + number_text(is) +
                      " m; expected the same, not " + number_text(is_asked));
  };
  refuse("map_voxel", its.map_voxel, asked.map_voxel);
  refuse("tile", its.tile, asked.tile);
}

}  // namespace

bool is_session_name(const std::string& name) {
  const auto is_allowed = [](unsigned char c) {
    return c < 128 && (std::isalnum(c) != 0 || c == '.' || c == '_' || c == '-');
  };
  return !name.empty() && name.size() <= 100 && name.front() != '.' && name.front() != '-' &&
         std::all_of(name.begin(), name.end(), is_allowed);
}

City::City(const fs::path& folder)
    : folder_(folder), grid_(session_files::read_city(folder / session_files::kCityFile)) {}

City City::open_or_make(const fs::path& folder, const SessionGrid& grid) {
  grid.validate();
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) fail_by_system(folder, "cannot be created", error.value());
  const FolderLock lock = session_files::lock_city(folder);
  const fs::path file = folder / session_files::kCityFile;
  if (!fs::exists(file)) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      if (target_of_temporary(name) == session_files::kCityFile) fs::remove(entry, error);
    }
    if (!fs::is_empty(folder, error) || error) {
      fail(folder, "holds files but no city.json; expected a map of many sessions or nothing");
    }
    AtomicFile city(file);
    city.stream() << session_files::city_text(grid);
    city.commit();
    return City(folder, grid);
  }
  City city(folder);
  refuse_other_grid(folder, city.grid(), grid);
  return city;
}

std::vector<SessionInfo> City::sessions() const {
  std::vector<SessionInfo> sessions;
  for (const std::string& name : session_names(folder_)) {
    sessions.push_back(session_files::read_session(folder_ / name / session_files::kSessionFile));
  }
  // The names are sorted already.
  std::stable_sort(sessions.begin(), sessions.end(),
                   [](const SessionInfo& a, const SessionInfo& b) { return a.begin < b.begin; });
  return sessions;
}

std::vector<SessionPoint> City::read_tile(const SessionInfo& session, const TileIndex& tile) const {
  const auto found = session.tiles.find(tile);
  if (found == session.tiles.end()) return {};
  const fs::path path =
      session_folder(session.name) / session_files::kTileFolder / session_files::tile_name(tile);
  std::vector<SessionPoint> points = session_files::read_tile(path, grid_, tile);
  if (points.size() != found->second) {
    fail_at_byte(path, 40,
                 std::to_string(points.size()) + " points; session.json tells of " +
                     std::to_string(found->second));
  }
  return points;
}

void City::drop(const std::string& name) {
  const FolderLock lock = session_files::lock_city(folder_);
  const fs::path session = session_folder(name);
  if (!is_session_name(name) || !fs::is_directory(fs::symlink_status(session))) {
    fail(folder_, "has no session \"" + name + '"');
  }
  session_files::read_session(session / session_files::kSessionFile);
  const fs::path foreign = session_files::foreign_entry(session);
  if (!foreign.empty()) fail(foreign, "is not part of the session, which stays as it is");
  // One rename takes the session out of the map. Its files are removed after that.
  const fs::path aside = session_files::make_staging(folder_, name);
  std::error_code error;
  fs::rename(session, aside, error);
  if (error) {
    const int code = error.value();
    fs::remove(aside, error);
    fail_by_system(session, "cannot be moved aside", code);
  }
  sync_files(folder_);
  session_files::remove_session_files(aside);
}

std::vector<std::string> City::check() const {
  std::vector<std::string> defects;
  const auto note = [&](auto&& work) {
    try {
      work();
    } catch (const IoError& error) {
      defects.emplace_back(error.what());
    }
  };
  for (const fs::path& link : linked_sessions(folder_)) {
    defects.push_back(link.string() + ": is a link, which is no session");
  }
  for (const std::string& name : session_names(folder_)) {
    note([&] {
      const fs::path folder = session_folder(name);
      const fs::path file = folder / session_files::kSessionFile;
      const SessionInfo session =
          session_files::read_session(file, session_files::Checksum::kRequired);
      check_count(file, session);
      const fs::path foreign = session_files::foreign_entry(folder);
      if (!foreign.empty()) fail(foreign, "is not part of the session");
      for (const auto& tile : session.tiles) {
        note([&] {
          const fs::path tiles = folder / session_files::kTileFolder;
          check_bounds(tiles / session_files::tile_name(tile.first), grid_, session, tile.first,
                       read_tile(session, tile.first));
        });
      }
      for (const auto& entry : fs::directory_iterator(folder / session_files::kTileFolder)) {
        const bool is_listed =
            std::any_of(session.tiles.begin(), session.tiles.end(), [&](const auto& tile) {
              return session_files::tile_name(tile.first) == entry.path().filename();
            });
        if (!is_listed)
          defects.push_back(entry.path().string() + ": session.json does not list it");
      }
      const SessionReferenceReader references(*this, session);
      if (references.entries().size() != session.references) {
        fail(file, "/references: expected " + std::to_string(references.entries().size()));
      }
      RecordingReference reference;
      for (const auto& entry : references.entries()) {
        note([&] { references.read(entry, reference); });
      }
    });
  }
  return defects;
}

}  // namespace dynains
