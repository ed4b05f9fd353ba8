// Other options under which the points of a recording may be read.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "dynains/io/recording.hpp"

namespace dynains {

/// Whether points in the files move with the sensor, as those in the frame of the world do. Empty
/// if the sensor stays within `min_way` (m) of its first place. Throws IoError.
std::optional<bool> follow_sensor(const Recording& recording, double min_way);

/// Other ways to read the points of a recording that does not agree: de-skewed or not, in the frame
/// of the sensor or of the world, or with rays from `ray_origin` (m, frame of the clouds in the
/// files). Throws IoError.
std::vector<RecordingOptions> other_options(const Recording& recording,
                                            const std::optional<Eigen::Vector3d>& ray_origin);

}  // namespace dynains
