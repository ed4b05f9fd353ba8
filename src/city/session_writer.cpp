#include "dynains/city/session_writer.hpp"

#include <Eigen/Geometry>
#include <filesystem>
#include <utility>

#include "dynains/errors.hpp"
#include "io/failure.hpp"
#include "session_file.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

/// Removes the files of killed writers from a locked city: each writer has the lock.
void remove_temporaries(const City& city) {
  std::error_code ignored;  // files of another user, for example, do not stop this writer
  for (const auto& entry : fs::directory_iterator(city.folder())) {
    const fs::path target = target_of_temporary(entry.path().filename().string());
    const bool is_file = fs::is_regular_file(entry.symlink_status());
    if (is_file && target.extension() == ".session") fs::remove(entry.path(), ignored);
  }
}

}  // namespace

SessionWriter::SessionWriter(const City& city, SessionInfo session, Mode mode)
    : city_(city),
      session_(std::move(session)),
      mode_(mode),
      store_(city.folder()),
      points_(city.grid(), kTestRange, store_),
      references_(/*max_scans=*/10, session_.evidence.lateral_margin) {
  if (!is_session_name(session_.name)) {
    throw ConfigError("SessionInfo.name = \"" + session_.name +
                      "\" must consist of letters, digits, '.', '_' and '-', and begin with a "
                      "letter, a digit or '_'");
  }
  check();
  session_.grid = city.grid();
  session_.scans = session_.points = 0;
  session_.tiles.clear();
  session_.references.clear();
}

// Throws unless the city can take the session.
void SessionWriter::check() {
  city_.reload();
  const fs::path file = city_.session_file(session_.name);
  const bool exists = fs::exists(fs::symlink_status(file));
  if (mode_ == Mode::kReplace && !fs::is_regular_file(fs::symlink_status(file))) {
    fail(city_.folder(), "has no session \"" + session_.name + "\" to replace");
  }
  if (mode_ == Mode::kNew && exists) {
    throw UsageError(file.string() +
                     ": exists; a session is added once. Drop it first, or choose another name");
  }
  if (session_.fingerprint.empty()) return;
  for (const SessionInfo& other : city_.sessions()) {
    if (other.fingerprint != session_.fingerprint || other.name == session_.name) continue;
    throw UsageError(city_.session_file(other.name).string() +
                     ": is a session of the same scans, poses and times already");
  }
}

void SessionWriter::add(PointsView points, Span<const PointLabel> verdicts,
                        Span<const std::uint32_t> labels, const Pose& T_session_sensor,
                        std::uint32_t scan) {
  const Pose T_world_sensor =
      session_.alignment ? orthonormalized(session_.alignment->T_city_session * T_session_sensor)
                         : T_session_sensor;
  ++session_.scans;
  points_.add(points, verdicts, labels, T_world_sensor, scan);
  const RecordingReference* const reference =
      references_.add(points, verdicts, T_world_sensor, scan);
  if (reference == nullptr) return;
  session_.image_grid = references_.grid();
  const PoseRows rows = rows_of(T_world_sensor);
  bytes_.clear();
  add_bytes(&rows, 1, bytes_);
  pack_image(reference->image, bytes_);
  session_.references.push_back(
      {scan, T_world_sensor.translation(), {store_.append(bytes_), bytes_.size()}});
}

void SessionWriter::prepare() {
  locked_ = std::make_shared<Folder>(lock_city(city_.folder()));
  check();
  remove_temporaries(city_);
  file_ = std::make_unique<AtomicFile>(city_.session_file(session_.name));
  SessionFileWriter writer(file_->stream());
  Eigen::AlignedBox3d box;
  points_.for_each_tile([&](const TileIndex& tile, const std::vector<SessionPoint>& points) {
    for (const SessionPoint& point : points) box.extend(position_of(session_.grid, tile, point));
    session_.tiles[tile] = writer.add(
        {reinterpret_cast<const char*>(points.data()), points.size() * sizeof(SessionPoint)});
  });
  session_.points = points_.size();
  if (box.isEmpty()) box.extend(Eigen::Vector3d::Zero());
  session_.lowest = box.min();
  session_.highest = box.max();
  for (SessionReference& reference : session_.references) {
    store_.read(reference.block.offset, reference.block.size, bytes_);
    reference.block = writer.add({reinterpret_cast<const char*>(bytes_.data()), bytes_.size()});
  }
  writer.finish(session_);
  file_->finish();
}

void SessionWriter::commit() {
  if (!file_) prepare();
  file_->commit();
}

}  // namespace dynains
