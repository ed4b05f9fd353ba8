// The log of a recording, written again with its clouds cleaned or marked.
#pragma once

#include <filesystem>

#include "run.hpp"
#include "run_plan.hpp"
#include "verdict_files.hpp"

namespace dynains::run {

/// Throws ConfigError if the recording of a run that writes its log is no log, or the target no
/// MCAP.
void check_log_output(const RunPlan& plan);

/// Copies the log with the final labels of the scans of the run, in their order, to `file`. Warns
/// of clouds on the topic that have none, which stay as they are. False after a signal. Throws
/// IoError.
bool write_log(const RunPlan& plan, const PointStore& labels, const std::filesystem::path& file,
               const Warn& warn);

}  // namespace dynains::run
