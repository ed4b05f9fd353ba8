#include "dynains/city/session_writer.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "dynains/errors.hpp"
#include "dynains/io/atomic_file.hpp"
#include "dynains/io/folder_lock.hpp"
#include "io/failure.hpp"
#include "io/folder_exchange.hpp"
#include "io/new_file.hpp"
#include "session_files.hpp"
#include "session_folder.hpp"
#include "session_json.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

/// Removes the staging folders of killed processes.
void remove_stale_staging(const fs::path& city) {
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(city)) {
    const bool is_staging = session_files::is_staging_name(entry.path().filename().string()) &&
                            entry.is_directory() && !entry.is_symlink();
    if (is_staging) folders.push_back(entry.path());
  }
  for (const fs::path& folder : folders) {
    try {
      const FolderLock lock(folder);
      session_files::remove_session_files(folder);
    } catch (const UsageError&) {
      // Its writer lives.
    } catch (const IoError&) {
      // Files of another user, for example: they do not stop this writer.
    }
  }
}

/// Throws unless the city can take the session.
void check_session(const City& city, const SessionInfo& session, bool replaces) {
  const fs::path folder = city.session_folder(session.name);
  if (replaces) {
    if (!fs::is_directory(fs::symlink_status(folder))) {
      fail(city.folder(), "has no session \"" + session.name + "\" to replace");
    }
    const fs::path foreign = session_files::foreign_entry(folder);
    if (!foreign.empty()) fail(foreign, "is not part of the session, which stays as it is");
  } else if (fs::exists(fs::symlink_status(folder))) {
    throw UsageError(folder.string() +
                     ": exists; a session is added once. Drop it first, or choose another name");
  }
  if (session.fingerprint.empty()) return;
  for (const SessionInfo& other : city.sessions()) {
    if (other.fingerprint != session.fingerprint || other.name == session.name) continue;
    throw UsageError(city.session_folder(other.name).string() +
                     ": is a session of the same scans, poses and times already");
  }
}

}  // namespace

/// The staging folder of a session.
class SessionWriter::Files {
 public:
  Files(const fs::path& city, const std::string& session)
      : folder_(session_files::make_staging(city, session)),
        lock_(folder_),
        references_(reference_path()) {
    std::error_code error;
    if (!fs::create_directory(folder_ / session_files::kTileFolder, error)) {
      fail_by_system(folder_, "cannot be written", error.value());
    }
  }
  ~Files() {
    if (is_committed_) return;
    try {
      session_files::remove_session_files(folder_);
    } catch (const IoError&) {
      // The next writer removes the rest.
    }
  }
  Files(const Files&) = delete;
  Files& operator=(const Files&) = delete;

  void add_reference(const RangeImageGrid& grid, const RecordingReference& reference) {
    if (!has_header_) {
      const std::string header = session_files::reference_header(grid);
      references_.write(header);
      has_header_ = true;
    }
    references_.write(session_files::reference_record(reference, record_));
  }
  void write_tile(const TileIndex& tile, const std::string& bytes) {
    write_file(tile_path(tile), bytes);
  }
  std::vector<SessionPoint> read_tile(const SessionGrid& grid, const TileIndex& tile) const {
    return session_files::read_tile(tile_path(tile), grid, tile);
  }
  /// Writes the rest to the disk.
  void finish(const std::string& session_text) {
    references_.close();
    write_file(folder_ / session_files::kSessionFile, session_text);
    sync_files(folder_);
  }
  void commit(const fs::path& target) {
    const bool has_earlier = put_in_place(folder_, target);
    is_committed_ = !has_earlier;
    sync_files(target);
    // The staging folder has the earlier session now.
    if (has_earlier) session_files::remove_session_files(folder_);
  }

 private:
  fs::path reference_path() const { return folder_ / session_files::kReferenceFile; }
  fs::path tile_path(const TileIndex& tile) const {
    return folder_ / session_files::kTileFolder / session_files::tile_name(tile);
  }

  fs::path folder_;
  FolderLock lock_;
  NewFile references_;
  std::vector<char> record_;
  bool has_header_ = false;
  bool is_committed_ = false;
};

SessionWriter::SessionWriter(const City& city, SessionInfo session,
                             const SessionPointsConfig& points,
                             const RecordingReferencesConfig& references, Mode mode)
    : city_(city),
      session_(std::move(session)),
      mode_(mode),
      points_(city.grid(), points),
      references_(references, FreeSpaceConfig().lateral_margin) {
  if (!is_session_name(session_.name)) {
    throw ConfigError("SessionInfo.name = \"" + session_.name +
                      "\" must consist of letters, digits, '.', '_' and '-', and begin with a "
                      "letter, a digit or '_'");
  }
  session_files::check_config_text(session_.config);
  check_session(city_, session_, mode_ == Mode::kReplace);
  {
    const FolderLock lock = session_files::lock_city(city_.folder());
    remove_stale_staging(city_.folder());
    files_ = std::make_unique<Files>(city_.folder(), session_.name);
  }
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  session_.lowest.setConstant(kInfinity);
  session_.highest.setConstant(-kInfinity);
  session_.scans = session_.points = session_.references = 0;
  session_.tiles.clear();
}

SessionWriter::~SessionWriter() = default;

void SessionWriter::add(PointsView points, Span<const PointLabel> verdicts,
                        Span<const std::uint32_t> labels, const Pose& T_world_sensor,
                        std::uint32_t scan) {
  ++session_.scans;
  restore_near(T_world_sensor.translation());
  points_.add(points, verdicts, labels, T_world_sensor, scan);
  points_.release_far(T_world_sensor.translation(),
                      [&](const TileIndex& tile, const std::vector<SessionPoint>& of_tile) {
                        write_tile(tile, of_tile);
                        released_.insert(tile);
                      });
  const RecordingReference* const reference =
      references_.add(points, verdicts, T_world_sensor, scan);
  if (reference == nullptr) return;
  files_->add_reference(references_.grid(), *reference);
  ++session_.references;
}

void SessionWriter::restore_near(const Eigen::Vector3d& sensor) {
  for (auto tile = released_.begin(); tile != released_.end();) {
    if (!points_.reaches(sensor, *tile)) {
      ++tile;
      continue;
    }
    points_.restore(*tile, files_->read_tile(city_.grid(), *tile));
    tile = released_.erase(tile);
  }
}

void SessionWriter::write_tile(const TileIndex& tile, const std::vector<SessionPoint>& points) {
  files_->write_tile(tile, session_files::tile_bytes(city_.grid(), tile, points));
  session_.tiles[tile] = points.size();
  for (const SessionPoint& point : points) {
    const Eigen::Vector3d position =
        tile_corner(city_.grid(), tile) + Eigen::Vector3d(static_cast<double>(point.x),
                                                          static_cast<double>(point.y),
                                                          static_cast<double>(point.z));
    session_.lowest = session_.lowest.cwiseMin(position);
    session_.highest = session_.highest.cwiseMax(position);
  }
}

void SessionWriter::prepare() {
  points_.for_each_tile([&](const TileIndex& tile, const std::vector<SessionPoint>& points) {
    write_tile(tile, points);
  });
  for (const auto& tile : session_.tiles) session_.points += tile.second;
  if (session_.points == 0) session_.lowest = session_.highest = Eigen::Vector3d::Zero();
  files_->finish(session_files::session_text(session_));
  is_prepared_ = true;
}

void SessionWriter::commit() {
  if (!is_prepared_) prepare();
  const FolderLock lock = session_files::lock_city(city_.folder());
  check_session(city_, session_, mode_ == Mode::kReplace);
  files_->commit(city_.session_folder(session_.name));
}

}  // namespace dynains
