// The check of a recording: of the whole of it for `dynains check` and the Python module, and that
// before the first scan of a run.
#pragma once

#include <string>
#include <vector>

#include "dynains/config.hpp"
#include "dynains/io/recording.hpp"
#include "dynains/poses/diagnosis.hpp"
#include "run/scan_range.hpp"

namespace dynains::run {

/// The flags of `dynains run` that change the given options into `proposal`, such as
/// `--invert-poses --pose-units mm`; empty if nothing changes, or if a flag has to be left out.
std::string proposed_flags(const Recording& recording, const RecordingOptions& proposal);

/// One sentence with the verdict on the poses and the proposed flags.
std::string advice(const Recording& recording, const Diagnosis& diagnosis);

struct RecordingCheck {
  Diagnosis diagnosis;
  std::string findings;  ///< counts, units, sensor, motion, agreement, remarks; lines of text
  std::string advice;    ///< on the poses, a line; empty if only `remark` matters
  std::string flags;     ///< of `dynains run` that the advice proposes; empty: none
  std::string remark;    ///< on scans that are too far apart, a line; empty: none
  bool passed = false;   ///< whether a run needs no other options
};

/// Looks at the size of every scan file and at a sample of scans. Throws IoError.
RecordingCheck check_recording(const Recording& recording);

struct StartCheck {
  std::vector<std::string> warnings;
  std::string refusal;  ///< why the run must not begin; empty: it may
};

/// Judges the poses, and the clouds of `range`. Poses of an odometry of this program, those of
/// fewer than eight scans, and all with `accepts_poses` are not judged. Throws IoError.
StartCheck check_start(const Recording& recording, const ScanRange& range,
                       const RemoverConfig& config, bool accepts_poses);

}  // namespace dynains::run
