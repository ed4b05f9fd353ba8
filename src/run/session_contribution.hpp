// Contribution of a run to a map of many sessions.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "dynains/city/city.hpp"
#include "dynains/city/session_writer.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/points.hpp"
#include "dynains/pose.hpp"
#include "dynains/verdict.hpp"
#include "scan_range.hpp"

namespace dynains::program {

/// Which session goes into which map of many sessions.
struct SessionRequest {
  std::filesystem::path city;  ///< by whole_path(); empty: none
  SessionInfo info;            ///< without counts
  SessionGrid grid;
  std::optional<Pose> T_city_start;  ///< of the alignment; empty: none is asked for

  /// Whether the city has this session already, from the same scans, poses, times and
  /// configuration. Throws IoError.
  bool is_fulfilled() const;
};

/// A session of the map in `folder`, to be written again under poses of this fingerprint: begin,
/// recording and configuration stay, an alignment ends. Throws ConfigError if there is none of this
/// name, IoError.
SessionRequest reposed_session(const std::filesystem::path& folder, const std::string& name,
                               const std::string& fingerprint);

/// The request with the alignment that it asks for. Nothing changes in the map. Throws ConfigError
/// if the scans do not fit, IoError.
SessionRequest aligned(SessionRequest request, const Recording& recording, const ScanRange& range);

/// Takes the final verdicts of a run. Adds or replaces the session at once by commit(); until then,
/// and after any error or signal, the map is as it was.
class SessionContribution {
 public:
  /// Throws ConfigError, IoError, UsageError: see SessionWriter.
  explicit SessionContribution(const SessionRequest& request,
                               SessionWriter::Mode mode = SessionWriter::Mode::kNew);

  /// `labels` of the recording may be empty. `number`: of the scan.
  void add(const RecordedScan& scan, const ScanVerdict& verdict,
           const std::vector<std::uint32_t>& labels, std::size_t number);
  /// See SessionWriter.
  void prepare() { writer_.prepare(); }
  void commit() { writer_.commit(); }

 private:
  City city_;
  ByteStore store_;
  SessionWriter writer_;
  std::optional<Pose> T_city_session_;
  PointBuffer points_;
};

}  // namespace dynains::program
