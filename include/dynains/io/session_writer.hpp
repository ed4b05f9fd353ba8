// Writer of the contribution of one session to a map of many sessions.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <utility>

#include "dynains/evidence/session_references.hpp"
#include "dynains/io/city.hpp"
#include "dynains/map/session_points.hpp"
#include "dynains/points.hpp"

namespace dynains {

/// Takes the final verdicts of a session scan by scan, and adds the session to a city at once by
/// `commit()`. Until then, the files are in the folder `.NAME.0123456789abcdef.staging` of the
/// city, which nobody reads. Without a commit, the destructor removes it; that of a killed process
/// is removed by the next writer. References go to the disk as they come; points stay in memory.
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
                const SessionReferencesConfig& references = {}, Mode mode = Mode::kNew);
  SessionWriter(const City& city, SessionInfo session, Mode mode)
      : SessionWriter(city, std::move(session), {}, {}, mode) {}
  ~SessionWriter();
  SessionWriter(const SessionWriter&) = delete;
  SessionWriter& operator=(const SessionWriter&) = delete;

  /// Adds one scan. `points`: m, sensor frame. `verdicts`: final verdict by point. `labels`: label
  /// of the recording by point, or empty. `scan`: its number; ascending. Throws IoError.
  void add(PointsView points, Span<const PointLabel> verdicts, Span<const std::uint32_t> labels,
           const Eigen::Isometry3d& T_world_sensor, std::uint32_t scan);

  /// Puts the session in place, on the disk. Throws IoError or UsageError; the city is then
  /// unchanged. A session that is replaced must not hold foreign files; its file system must be
  /// able to exchange two folders.
  void commit();

 private:
  class Files;

  City city_;
  SessionInfo session_;
  Mode mode_;
  SessionPoints points_;
  SessionReferences references_;
  std::unique_ptr<Files> files_;
};

}  // namespace dynains
