// The check of a recording for `dynains check` and the Python module.
#pragma once

#include <string>

#include "dynains/io/recording.hpp"
#include "dynains/poses/diagnosis.hpp"

namespace dynains::run {

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

}  // namespace dynains::run
