// Writer of the contribution of one session to a map of many sessions.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "dynains/city/city.hpp"
#include "dynains/city/session_points.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/references.hpp"

namespace dynains {

/// Takes the final verdicts of a session scan by scan, and adds the session to a city at once by
/// `commit()`. Until then, the files are in the folder `.NAME.0123456789abcdef.staging` of the
/// city, which nobody reads. Without a commit, the destructor removes it; that of a killed process
/// is removed by the next writer. References go to the disk as they come, and points when their
/// tile is far behind the sensor: the memory does not grow with the length of the way.
class SessionWriter {
 public:
  enum class Mode {
    kNew,      ///< the city has no session of this name
    kReplace,  ///< the city has one; commit() puts this one in its place in one step
  };

  /// `session`: name, begin, recording, fingerprint and config; the rest is counted here. Throws
  /// ConfigError for an invalid name or config, UsageError if the city has a session of this name
  /// or of this fingerprint, IoError if the city is not writable.
  SessionWriter(const City& city, SessionInfo session, const SessionPointsConfig& points = {},
                const RecordingReferencesConfig& references = {}, Mode mode = Mode::kNew);
  SessionWriter(const City& city, SessionInfo session, Mode mode)
      : SessionWriter(city, std::move(session), {}, {}, mode) {}
  ~SessionWriter();
  SessionWriter(const SessionWriter&) = delete;
  SessionWriter& operator=(const SessionWriter&) = delete;

  /// Adds one scan. `points`: m, sensor frame. `verdicts`: final verdict by point. `labels`: label
  /// of the recording by point, or empty. `scan`: its number; ascending. Throws IoError.
  void add(PointsView points, Span<const PointLabel> verdicts, Span<const std::uint32_t> labels,
           const Pose& T_world_sensor, std::uint32_t scan);

  /// Number of points in memory.
  std::size_t held_points() const { return points_.size(); }

  /// Writes all files to the disk, so that nothing but their place is left to commit(). No scan can
  /// be added then. Throws IoError.
  void prepare();

  /// prepare(), and puts the session in place, on the disk. Throws IoError or UsageError; the city
  /// is then unchanged. A session that is replaced must not hold foreign files; its file system
  /// must be able to exchange two folders.
  void commit();

 private:
  class Files;

  void restore_near(const Eigen::Vector3d& sensor);
  void write_tile(const TileIndex& tile, const std::vector<SessionPoint>& points);

  City city_;
  SessionInfo session_;
  Mode mode_;
  SessionPoints points_;
  RecordingReferences references_;
  std::set<TileIndex> released_;  // tiles on the disk only
  std::unique_ptr<Files> files_;
  bool is_prepared_ = false;
};

}  // namespace dynains
