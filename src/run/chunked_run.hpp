// A run in chunks: several workers judge them, and their results are put together in order.
#pragma once

#include <filesystem>

#include "run.hpp"
#include "run_plan.hpp"
#include "run_results.hpp"
#include "run_timing.hpp"

namespace dynains::program {

/// Processes the chunks of `plan` in `plan.jobs` threads and fills `results` and the label files
/// in `folder`. Finished chunks that an earlier run left there are used, if they are whole. After a
/// signal the results are those of the first chunks, as far as they are finished; finished
/// chunks stay in the folder. Throws IoError, PoseError.
RunTiming run_in_chunks(const RunPlan& plan, const RunListener& listener,
                        const std::filesystem::path& folder, RunResults& results);

}  // namespace dynains::program
