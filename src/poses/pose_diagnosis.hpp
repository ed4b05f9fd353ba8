// Second part of the diagnosis: poses against the registration of scans.
#pragma once

#include "dynains/io/recording.hpp"
#include "dynains/poses/diagnosis.hpp"
#include "pose_test.hpp"

namespace dynains {

/// Whether registrations stay at the poses that were tested, so that no other hypothesis is needed.
/// Then sets the verdict, the agreement and the error of the poses. `test`: of the given poses.
bool is_settled(const Recording& recording, const PoseTest& test, Diagnosis& d);

/// Completes a diagnosis whose verdict follows from the agreement of scans: measures the error of
/// the poses, and tries an extrinsic calibration and an offset of the time. `test`: of the given
/// poses. Throws IoError.
void compare_with_registration(const Recording& recording, const PoseTest& test, Diagnosis& d);

}  // namespace dynains
