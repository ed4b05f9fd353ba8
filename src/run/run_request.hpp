// Everything that determines the results of a run, so that `--resume` can compare two runs.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <string>

#include "dynains/compiled_remover.hpp"
#include "dynains/io/recording.hpp"
#include "run_results.hpp"

namespace dynains::program {

/// Version, configuration, outputs, the frame of the points, and a fingerprint of names, poses and
/// times of the scans; their points are not read. A map on the disk has another order of points
/// than a map in memory, independent of its budget.
nlohmann::ordered_json describe_request(const Recording& recording, const ScanRange& range,
                                        const RunOutputs& outputs,
                                        const nlohmann::ordered_json& configuration);

/// Flags of a recording that tell how its points are stored. A request holds those that were given.
inline constexpr std::array kPointFlags = {"--point-units", "--point-time-unit", "--bin-columns",
                                           "--self-box"};

/// Fingerprint of the names, poses and times of the scans, as in describe_request().
std::string pose_fingerprint(const Recording& recording, const ScanRange& range);

/// Which fields of `request` an earlier run with this report had otherwise, the first few with both
/// values; empty if none differs.
std::string request_differences(const nlohmann::ordered_json& report,
                                const nlohmann::ordered_json& request);

}  // namespace dynains::program
