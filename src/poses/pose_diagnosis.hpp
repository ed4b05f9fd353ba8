// Second part of the diagnosis: poses against the registration of scans.
#pragma once

#include "dynains/io/recording.hpp"
#include "dynains/poses/diagnosis.hpp"

namespace dynains {

/// Completes a diagnosis whose verdict follows from the agreement of scans: measures the error of
/// the poses, and tries an extrinsic calibration and an offset of the time. Throws IoError.
void compare_with_registration(const Recording& recording, Diagnosis& d);

/// Accepts the given poses of a sparse sensor in spite of a doubt if merged scans prove them: two
/// single scans of such a sensor have few surfaces in common.
void accept_proven_poses(const Recording& recording, Diagnosis& d);

}  // namespace dynains
