// Poses that jump once, as after a loop closure or a relocalisation.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "dynains/io/recording.hpp"

namespace dynains {

/// A motion that the sensor did not make.
struct PoseJump {
  std::size_t scan = 0;      ///< the first one after the jump
  double translation = 0.0;  ///< m
  double rotation = 0.0;     ///< deg
};

/// How far the given motion to scan `i` (from 1) lies from the nearer one of the motions before and
/// after it.
PoseJump deviation_at(const Recording& recording, std::size_t i);

/// Jumps of the poses of the scans `first` to `last` (inclusive): motions that differ from those
/// beside them, and from the registration of their scans. At most eight, the largest ones, in the
/// order of scans. Throws IoError.
std::vector<PoseJump> find_pose_jumps(const Recording& recording, std::size_t first,
                                      std::size_t last);

/// "poses jump 2 times, at scan 000030 by 1.50 m and 0.0 deg, ...": at most five of them, and the
/// number of the others.
std::string sentence_on(const Recording& recording, const std::vector<PoseJump>& jumps);

}  // namespace dynains
