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
  Agreement agreement;  ///< of a sample of scans; of no points if poses are not judged
  std::vector<std::string> warnings;
  std::string refusal;  ///< why the run must not begin; empty: it may
};

/// Judges the poses as `dynains check` does, and the clouds of `range`. Poses of an odometry of
/// this program, and those of fewer than eight scans, are not judged. With `accepts_poses`,
/// findings on poses are warnings. Throws IoError.
StartCheck check_start(const Recording& recording, const ScanRange& range,
                       const RemoverConfig& config, bool accepts_poses);

}  // namespace dynains::program
