// The judgement of poses and clouds before the first scan of a run.
#pragma once

#include <string>
#include <vector>

#include "dynains/config.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/poses/diagnosis.hpp"
#include "scan_range.hpp"

namespace dynains::program {

struct StartCheck {
  PoseAgreement agreement;
  std::vector<std::string> warnings;
  std::string refusal;  ///< why the run must not begin; empty: it may
};

/// Judges the poses and clouds of `range` as `dynains check` does, unless a few registrations prove
/// them. Fewer than eight scans are not refused; with `accepts_poses`, there is none.
/// `recording_as_given` names the recording in proposed commands. Throws IoError.
StartCheck check_start(const Recording& recording, const ScanRange& range,
                       const RemoverConfig& config, bool accepts_poses,
                       const std::string& recording_as_given);

}  // namespace dynains::program
