// The scans or the log of a recording, written again with their points cleaned or marked.
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
/// of clouds on the topic that have none, which stay as they are. Throws IoError, Interrupted.
void write_log(const RunPlan& plan, const PointStore& labels, const std::filesystem::path& file,
               const Warn& warn);

/// Writes a scan to `folder`: all finite points that are not dynamic, or with `drop_not_judged` all
/// static ones, in their order and frame. Files of .bin, .pcd and .ply are copied without the other
/// points, so that all columns stay as they are. Scans of other formats become .pcd with the
/// columns of the scan, m. Throws IoError.
void write_clean(const Recording& recording, const JudgedScan& judged,
                 const std::filesystem::path& folder, bool drop_not_judged);

}  // namespace dynains::run
