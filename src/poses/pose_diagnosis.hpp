// Second part of the diagnosis: poses against the registration of scans.
#pragma once

#include "dynains/io/recording.hpp"
#include "dynains/poses/diagnosis.hpp"

namespace dynains {

/// Completes a diagnosis whose verdict follows from the agreement of scans, if a few registrations
/// from the given poses stay there; returns whether they do. Also overrides a doubt about a sparse
/// sensor, two single scans of which have few surfaces in common. Throws IoError.
bool accept_proven_poses(const Recording& recording, Diagnosis& d);

/// Completes a diagnosis that nothing proves: measures the error of the poses, and tries an
/// extrinsic calibration and an offset of the time. Throws IoError.
void compare_with_registration(const Recording& recording, Diagnosis& d);

}  // namespace dynains
