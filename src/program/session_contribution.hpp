// Contribution of a run to a map of many sessions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/io/session_writer.hpp"
#include "dynains/points.hpp"
#include "dynains/verdict.hpp"

namespace dynains::program {

/// Which session goes into which map of many sessions.
struct SessionRequest {
  std::filesystem::path city;  ///< by whole_path(); empty: none
  SessionInfo info;            ///< without counts
  SessionGrid grid;

  /// Whether the city has this session already, from the same scans, poses, times and
  /// configuration. Throws IoError.
  bool is_fulfilled() const;
};

/// Takes the final verdicts of a run. Adds the session at once by commit().
class SessionContribution {
 public:
  /// Throws ConfigError, IoError, UsageError: see SessionWriter.
  explicit SessionContribution(const SessionRequest& request);

  /// `labels` of the recording may be empty. `number`: of the scan.
  void add(const RecordedScan& scan, const ScanVerdict& verdict,
           const std::vector<std::uint32_t>& labels, std::size_t number);
  void commit() { writer_.commit(); }

 private:
  SessionWriter writer_;
  PointBuffer points_;
};

}  // namespace dynains::program
