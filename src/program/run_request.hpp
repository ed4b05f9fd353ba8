// What the results of a run follow from, so that another run can tell whether they are its own.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "dynains/dyna_ins_remover.hpp"
#include "dynains/io/recording.hpp"
#include "run_results.hpp"

namespace dynains::program {

/// Version, configuration, outputs, the frame of the points, and a fingerprint of names, poses and
/// times of the scans; their points are not read. A map on the disk takes its points in another
/// order than one in memory, whatever its budget.
nlohmann::ordered_json describe_request(const Recording& recording, const ScanRange& range,
                                        const RunOutputs& outputs, bool map_on_disk,
                                        const nlohmann::ordered_json& configuration);

enum class EarlierRun { kNone, kUnfinished, kComplete };

/// What report.json in `folder` says of an earlier run. Throws IoError that names what differs, if
/// that was another one.
EarlierRun find_earlier_run(const std::filesystem::path& folder,
                            const nlohmann::ordered_json& request);

}  // namespace dynains::program
