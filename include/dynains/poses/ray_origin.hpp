// Where the beams of clouds begin, measured from their points.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "dynains/io/recording.hpp"

namespace dynains {

/// Position (m, frame of the clouds in the files) at which the beams of a spinning sensor begin, if
/// it lies elsewhere than the recording says: points of one beam have one elevation (a ring is a
/// cone) from there, and clearly not from the origin of the scans. Scans at three places have to
/// agree about it. Empty if the origin is right, or if the pattern or the scene do not determine
/// it. Throws IoError.
std::optional<Eigen::Vector3d> other_ray_origin(const Recording& recording);

}  // namespace dynains
