// Proof of the given poses: registrations that begin at them stay there.
#pragma once

#include <cstddef>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/poses/diagnosis.hpp"
#include "pose_fit.hpp"

namespace dynains {

/// Motions over some scans, registered from the given poses.
struct GivenMotions {
  std::size_t tested = 0;                 ///< motions that were registered
  std::vector<RegisteredMotion> certain;  ///< those with a certain result
};

/// Registers motions between the scans `first` and `last` (inclusive) where a mistake would show
/// best: in the sharpest turn, at the largest change of speed, at the highest speed; and
/// of `neighbours` evenly spread pairs of neighbouring scans. Scans of sparse sensors are merged.
/// Throws IoError.
GivenMotions register_given(const Recording& recording, std::size_t first, std::size_t last,
                            std::size_t neighbours);

/// Whether merged scans of a sparse sensor agree under the given poses, and better than under each
/// of `readings` that moves the sensor otherwise. Throws IoError.
bool agrees_best(const Recording& recording, const std::vector<PoseReading>& readings,
                 const Mounting& mounting);

}  // namespace dynains
