// Clouds or poses that are missing within a recording whose poses belong to scans by their order.
#pragma once

#include <optional>
#include <vector>

#include "dynains/io/recording.hpp"
#include "dynains/poses/diagnosis.hpp"
#include "pose_fit.hpp"

namespace dynains {

/// Looks for a place from which on motions agree with the poses of rows some scans later or earlier
/// (at most 10, or as many as there are more rows than scans), while those before agree with the
/// poses as given. Empty unless the drive shows it: at constant speed all rows give one motion.
/// `exact`: m at points 10 m away, error of exact poses.
std::optional<LostScans> find_lost_scans(const Recording& recording,
                                         const std::vector<RegisteredMotion>& motions,
                                         double exact);

/// Whether there are more rows of poses than scans, though not so many as in a longer recording.
bool may_have_lost_clouds(const Recording& recording);

/// Looks at all scans of such a recording for the largest loss of clouds: from some scan on, the
/// later of two neighbouring places fits clearly better under the poses of later rows. Throws
/// IoError.
std::optional<LostScans> find_lost_clouds(const Recording& recording);

}  // namespace dynains
