// Second part of the diagnosis: poses against the registration of scans.
#pragma once

#include "dynains/io/recording.hpp"
#include "dynains/poses/diagnosis.hpp"

namespace dynains {

/// Completes a diagnosis whose verdict follows from the agreement of scans: measures the error of
/// the poses, and tries an extrinsic calibration and an offset of the time. Throws IoError.
void compare_with_registration(const Recording& recording, Diagnosis& d);

}  // namespace dynains
