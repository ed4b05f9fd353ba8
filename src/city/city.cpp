#include "dynains/city/city.hpp"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <system_error>
#include <thread>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"
#include "io/byte_reader.hpp"
#include "io/failure.hpp"
#include "io/folder.hpp"
#include "io/text.hpp"
#include "session_file.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

void refuse_other_grid(const fs::path& city, const SessionGrid& its, const SessionGrid& asked) {
  const auto refuse = [&](const char* field, double is, double is_asked) {
    if (is == is_asked) return;
    throw ConfigError(city.string() + ": its sessions have " + field + " = " + text::to_text(is) +
                      " m; expected the same, not " + text::to_text(is_asked));
  };
  refuse("map_voxel", its.map_voxel, asked.map_voxel);
  refuse("tile", its.tile, asked.tile);
}

bool is_within(const SessionGrid& grid, const SessionPoint& point) {
  const auto most = static_cast<float>(grid.tile);
  return point.x >= 0.0F && point.x <= most && point.y >= 0.0F && point.y <= most &&
         std::abs(point.z) < 1e6F;
}

}  // namespace

Folder lock_city(const fs::path& path) {
  using namespace std::chrono_literals;
  const auto end = std::chrono::steady_clock::now() + 10min;
  while (true) {
    try {
      Folder folder(path);
      folder.lock();
      return folder;
    } catch (const UsageError&) {
      if (std::chrono::steady_clock::now() > end) throw;
    }
    std::this_thread::sleep_for(20ms);
  }
}

bool is_session_name(const std::string& name) {
  const auto is_allowed = [](unsigned char c) {
    return c < 128 && (std::isalnum(c) != 0 || c == '.' || c == '_' || c == '-');
  };
  return !name.empty() && name.size() <= 100 && name.front() != '.' && name.front() != '-' &&
         std::all_of(name.begin(), name.end(), is_allowed);
}

City::City(const fs::path& folder) : City(folder, SessionGrid()) {
  reload();
  if (sessions_.empty()) fail(folder, "holds no session; expected a map of many sessions");
  grid_ = sessions_.front().grid;
}

City City::open_or_make(const fs::path& folder, const SessionGrid& grid) {
  grid.validate();
  create_folder(folder);
  City city(folder, grid);
  city.reload();
  if (!city.sessions_.empty()) {
    refuse_other_grid(folder, city.sessions_.front().grid, grid);
    return city;
  }
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (target_of_temporary(entry.path().filename().string()).empty()) {
      fail(folder, "holds files but no session; expected a map of many sessions or nothing");
    }
  }
  return city;
}

// Returns the names of all sessions in the folder, sorted.
std::vector<std::string> City::names() const {
  std::vector<std::string> names;
  for (const fs::path& path : paths_in(folder_)) {
    const bool is_session = path.extension() == ".session" && is_session_name(path.stem().string());
    if (is_session && fs::is_regular_file(fs::symlink_status(path))) {
      names.push_back(path.stem().string());
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

void City::reload() {
  sessions_.clear();
  for (const std::string& name : names()) {
    sessions_.push_back(read_session(session_file(name)));
    refuse_other_grid(session_file(name), sessions_.back().grid, sessions_.front().grid);
  }
  // The names are sorted already.
  std::stable_sort(sessions_.begin(), sessions_.end(),
                   [](const SessionInfo& a, const SessionInfo& b) { return a.begin < b.begin; });
}

std::vector<SessionPoint> City::read_tile(const SessionInfo& session, const TileIndex& tile) const {
  const auto found = session.tiles.find(tile);
  if (found == session.tiles.end()) return {};
  const fs::path path = session_file(session.name);
  const std::string bytes = read_block(path, found->second);
  std::vector<SessionPoint> points(bytes.size() / sizeof(SessionPoint));
  if (!points.empty()) std::memcpy(points.data(), bytes.data(), points.size() * sizeof(points[0]));
  if (!std::all_of(points.begin(), points.end(),
                   [&](const SessionPoint& point) { return is_within(grid_, point); })) {
    fail_at_byte(path, found->second.offset, "expected points within the tile");
  }
  return points;
}

void City::read_reference(const SessionInfo& session, const SessionReference& which,
                          RecordingReference& reference) const {
  const fs::path path = session_file(session.name);
  const std::string bytes = read_block(path, which.block);
  PoseRows rows{};
  const bool has_pose = bytes.size() >= sizeof(rows);
  if (has_pose) std::memcpy(rows.data(), bytes.data(), sizeof(rows));
  reference.scan = which.scan;
  reference.T_world_beams = pose_of(rows);
  const auto* const image = reinterpret_cast<const std::uint8_t*>(bytes.data()) + sizeof(rows);
  if (!has_pose ||
      !unpack_image(session.image_grid, {image, bytes.size() - sizeof(rows)}, reference.image)) {
    fail_at_byte(path, which.block.offset, "expected a pose and a coded range image");
  }
}

void City::drop(const std::string& name) {
  const Folder lock = lock_city(folder_);
  const std::vector<std::string> all = names();
  if (!std::binary_search(all.begin(), all.end(), name)) {
    fail(folder_, "has no session \"" + name + '"');
  }
  std::error_code error;
  fs::remove(session_file(name), error);
  if (error) fail_by_system(session_file(name), "cannot be removed", error.value());
  sync_files(folder_);
  const auto is_dropped = [&](const SessionInfo& session) { return session.name == name; };
  sessions_.erase(std::remove_if(sessions_.begin(), sessions_.end(), is_dropped), sessions_.end());
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
  std::map<std::string, std::string> names_of;  // by fingerprint
  City city = *this;
  for (const std::string& name : names()) {
    note([&] {
      const SessionInfo session = read_session(session_file(name));
      city.grid_ = session.grid;
      const auto [same, is_new] = names_of.emplace(session.fingerprint, name);
      for (const auto& tile : session.tiles) note([&] { city.read_tile(session, tile.first); });
      RecordingReference reference;
      for (const SessionReference& which : session.references) {
        note([&] { read_reference(session, which, reference); });
      }
      if (is_new || session.fingerprint.empty()) return;
      fail(session_file(name), "is a session of the same scans, poses and times as " +
                                   same->second + "; drop one of them");
    });
  }
  return defects;
}

}  // namespace dynains
