// Writer of the contribution of one session to a map of many sessions.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "dynains/city/city.hpp"
#include "dynains/city/session_points.hpp"
#include "dynains/io/atomic_file.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/recording/byte_store.hpp"
#include "dynains/recording/references.hpp"

namespace dynains {

class Folder;

/// Takes the final verdicts of a session scan by scan, and adds the session to a city at once by
/// commit(). Until prepare(), an unnamed file in the folder of the city holds all data.
/// Errors of files throw IoError.
class SessionWriter {
 public:
  enum class Mode {
    kNew,     ///< the city has no session of this name
    kReplace  ///< the city has one; commit() replaces it atomically
  };

  /// `session`: the fields before SessionInfo::grid; the writer sets the others. Throws ConfigError
  /// for an invalid name, UsageError if the city has a session of this name or of this fingerprint,
  /// IoError.
  SessionWriter(const City& city, SessionInfo session, Mode mode = Mode::kNew);

  /// Adds one scan. `points`: m, sensor frame. `verdicts`: final verdict by point. `labels`: label
  /// of the recording by point, or empty. `T_session_sensor` is moved by SessionInfo::alignment.
  /// `scan`: its number; ascending.
  void add(PointsView points, Span<const PointLabel> verdicts, Span<const std::uint32_t> labels,
           const Pose& T_session_sensor, std::uint32_t scan);

  /// Writes the session to the disk, so that nothing but its name is left to commit(). No scan can
  /// be added then, and the city is locked until the end of this object. Throws IoError, and
  /// UsageError as the constructor.
  void prepare();

  /// prepare(), and puts the session in place, on the disk. Throws IoError or UsageError; the city
  /// is then unchanged.
  void commit();

 private:
  void check();

  City city_;
  SessionInfo session_;
  Mode mode_;
  ByteStore store_;
  SessionPoints points_;
  RecordingReferences references_;
  std::vector<std::uint8_t> bytes_;
  std::shared_ptr<Folder> locked_;
  std::unique_ptr<AtomicFile> file_;
};

}  // namespace dynains
