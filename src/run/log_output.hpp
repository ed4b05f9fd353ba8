// The log of a recording, written again with its clouds cleaned or marked.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

#include "run_plan.hpp"

namespace dynains::run {

/// Throws ConfigError if the recording of a run that writes its log is no log, or the target no
/// MCAP.
void check_log_output(const RunPlan& plan);

/// Copies the log with the labels of the run in `results` to `file`. Returns the number of clouds
/// on the topic that have none, which stay as they are; nothing after a signal. Throws IoError.
std::optional<std::size_t> write_log(const RunPlan& plan, const std::filesystem::path& results,
                                     const std::filesystem::path& file);

}  // namespace dynains::run
