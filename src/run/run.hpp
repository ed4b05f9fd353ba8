// A run over a recording: from the scans to the folder of results.
#pragma once

#include <cstddef>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "dynains/city/session.hpp"
#include "dynains/io/recording.hpp"
#include "interrupt.hpp"
#include "run_settings.hpp"

namespace dynains::run {

using Warn = std::function<void(const std::string& text)>;

/// How a run and its caller reach each other while it lasts.
struct RunListener {
  Warn warn = [](const std::string&) {};
  /// Called before the first scan and after each.
  std::function<void(std::size_t done, std::size_t total)> progress = [](std::size_t, std::size_t) {
  };
  /// Called before the second pass revises the first scan and after each.
  std::function<void(std::size_t done, std::size_t total)> revision_progress = progress;
  SecondSignal second_signal = SecondSignal::kEndsProcess;
};

struct RunOutcome {
  RunOutputs outputs;  ///< their folder is that of unfinished results after a signal
  int signal = 0;      ///< that ended the run; 0: the results are complete
  nlohmann::ordered_json report;
  std::optional<SessionAlignment> alignment;  ///< of the session in a map of many sessions
};

/// Runs over a recording. SIGINT and SIGTERM end the run after the scan at hand: the results so
/// far then stay in the folder OUT.partial. Throws ConfigError, IoError, PoseError,
/// UsageError.
RunOutcome run(const RunSettings& settings, Recording recording, const RunListener& listener);

}  // namespace dynains::run
