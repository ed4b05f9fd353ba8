// A run over a recording: from the scans to the folder of results.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "dynains/city/session_alignment.hpp"
#include "dynains/io/recording.hpp"
#include "interrupt.hpp"
#include "run_report.hpp"
#include "run_results.hpp"
#include "run_settings.hpp"

namespace dynains::program {

/// How a run and its caller reach each other while it lasts. Both functions may be empty.
struct RunListener {
  std::function<void(const std::string&)> warn;
  /// Called before the first scan and after each.
  std::function<void(std::size_t done, std::size_t total)> progress;
  SecondSignal second_signal = SecondSignal::kEndsProcess;
};

struct RunOutcome {
  RunOutputs outputs;
  bool was_complete_before = false;   ///< --resume of a complete run: nothing below is known
  bool complete = true;               ///< false after a signal: `scans` were finished
  int signal = 0;                     ///< that ended the run
  bool earlier_results_stay = false;  ///< the run ended before it could replace them
  std::size_t scans = 0;
  std::uint64_t points = 0;
  LabelCounts labels;
  std::optional<std::size_t> map_points;
  Statistics time;  ///< ms per scan
  WallTime wall;
  std::size_t jobs = 1;
  std::optional<SessionAlignment> alignment;  ///< of the session in a map of many sessions
  std::filesystem::path page;                 ///< empty: none was asked for
};

/// Runs over a recording. SIGINT and SIGTERM end the run after the scan at hand: a new folder then
/// holds the results so far, and earlier results stay. Throws ConfigError, IoError, PoseError,
/// UsageError.
RunOutcome run(const RunSettings& settings, Recording recording, const RunListener& listener);

/// @name A run in chunks by several processes
/// One calls begin_chunks(), then any call judge_chunk(), then one calls run() with `resume`. All
/// have the same settings. Each throws UsageError while another needs the folder for itself, and
/// can be repeated after a failure.
/// @{
/// Checks a run and marks its folder as that of an unfinished run. Returns the number of its
/// chunks; 0 if run() does all of it: it has less than two chunks, is complete, or replaces other
/// results. Throws as run().
std::size_t begin_chunks(const RunSettings& settings, Recording recording,
                         const RunListener& listener);
/// Writes the file of one chunk, numbered from 0, unless it is there and whole, or the run is
/// complete. False after SIGINT or SIGTERM. Throws as run(), and IoError for a folder without such
/// a run.
bool judge_chunk(const RunSettings& settings, Recording recording, std::size_t number,
                 const RunListener& listener);
/// @}

}  // namespace dynains::program
